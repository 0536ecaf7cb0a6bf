"""The picture for people."""

import numpy as np
import pytest

from ja_common.core.annotate import annotate_image
from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind
from ja_common.core.posture import Posture
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import SalientFeatureDetector
from synthetic_pictures import draw_ball, draw_face, room


@pytest.mark.parametrize('size', [(64, 48), (320, 240), (640, 480)])
def test_draws_on_a_copy_what_was_found(size):
    width, height = size
    picture = room(width, height)
    draw_face(picture, width / 2, 0.45 * height, 0.3 * width)
    draw_ball(picture, 0.85 * width, 0.2 * height, 0.05 * width)
    camera = CameraModel.from_field_of_view(width, height, np.radians(36))
    posture = Posture(1, np.zeros(2), np.zeros(2))
    percept = SalientFeatureDetector(BlazeFace()).detect(picture, 1, camera, posture)
    before = picture.copy()
    drawn = annotate_image(
        picture, percept.detections, percept.face_image, camera, d_th_rad=0.1, latency_s=0.0123
    )
    assert np.array_equal(picture, before)
    scale = drawn.shape[1] // width
    assert drawn.shape == (scale * height, scale * width, 3)
    assert drawn.shape[1] >= 480
    # The circle of d_th around the centre, white wherever nothing else covers it.
    angles = np.linspace(0, 2 * np.pi, 90)
    radius = scale * camera.fx * np.tan(0.1)
    u = (scale * (camera.cx + 0.5) - 0.5 + radius * np.cos(angles)).astype(int)
    v = (scale * (camera.cy + 0.5) - 0.5 + radius * np.sin(angles)).astype(int)
    white = [
        drawn[y - 1 : y + 3, x - 1 : x + 3].min(axis=2).max() > 200
        for x, y in zip(u, v, strict=True)
    ]
    assert np.mean(white) > 0.7
    if percept.face_image is not None:
        inset = drawn[: drawn.shape[0] // 5, -drawn.shape[1] // 8 :]
        assert np.all(inset[..., 0] == inset[..., 1])


@pytest.mark.parametrize('size', [(1, 1), (1, 700), (9000, 2), (320, 240)])
@pytest.mark.parametrize('place', [0.0, -1e12, 1e30])
def test_draws_what_another_node_claims_to_have_found(size, place):
    """At any place, of any size, in a picture of any shape; the drawing stays as small as that."""
    width, height = size
    picture = np.zeros((height, width, 3), np.uint8)
    camera = CameraModel.from_field_of_view(width, height, 0.6)
    found = [Detection(kind, *[place] * 7, 1, place, place, place) for kind in Kind]
    face = np.zeros((400, 300), np.uint8)
    drawn = annotate_image(picture, found, face, camera, d_th_rad=0.1, latency_s=0.0)
    assert max(drawn.shape) < 480 + max(size)


def test_draws_the_range_beside_the_box_where_it_is_known():
    camera = CameraModel.from_field_of_view(320, 240, np.radians(36))
    ball = Detection(Kind.OBJECT, 0.0, 0.0, 160.0, 120.0, 30.0, 30.0, score=0.5, track_id=1)

    def draw(detection: Detection) -> np.ndarray:
        return annotate_image(room(), [detection], None, camera, d_th_rad=0.1, latency_s=0.0)

    without = draw(ball)
    changed = draw(ball._replace(range_m=0.83, range_deviation_m=0.01)) != without
    rows, columns, _ = np.nonzero(changed)
    enlarge = without.shape[1] / 320
    assert rows.size
    # In the line above the box, to the right of the score.
    assert rows.max() <= (120 - 15) * enlarge
    assert columns.min() >= 160 * enlarge
