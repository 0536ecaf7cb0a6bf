"""Landmarks and gaze on the page: where they are drawn, and when they are subscribed."""

import math
import re

import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind
from ja_common.core.face_gaze import FaceGaze
from ja_common.core.geometry import directions_of_rays
from ja_dashboard.core import drawings
from ja_dashboard.core.gaze_view import GazeView, draw_gaze
from ja_dashboard.core.view_model import SceneView
from ja_dashboard.image_feed import Picture

FACE = Detection(Kind.FACE, 0.0, 0.0, 100.0, 60.0, 20.0, 24.0, 1.0, attended=True)
NAN = math.nan
LEFT, DOWN, AT_THE_CAMERA = (0.6, 0.0), (0.0, 0.6), (0.0, 0.0)


def read(head, eyes=((NAN, NAN), (NAN, NAN))):
    return FaceGaze(np.array([*head, 0.0]), 0.03, np.array(eyes), 0.04)


def drawn(view, scale=1.0):
    canvas = np.zeros((120, 200, 3), np.uint8)
    draw_gaze(canvas, view, [FACE], scale)
    return np.argwhere(canvas.any(axis=2))


def test_the_gaze_adds_the_mean_of_the_visible_eyes_to_the_head():
    one = GazeView(gaze=read((0.3, 0.1), ((0.2, -0.1), (NAN, NAN))))
    assert one.direction == pytest.approx((0.5, 0.0))
    both = GazeView(gaze=read((0.3, 0.1), ((0.2, -0.1), (0.0, 0.1))))
    assert both.direction == pytest.approx((0.4, 0.1))
    assert GazeView(gaze=read((0.3, 0.1))).direction == pytest.approx((0.3, 0.1))
    assert GazeView().direction is None


def test_the_arrow_points_to_where_she_looks():
    rows, columns = drawn(GazeView(gaze=read(LEFT))).T
    assert columns.min() == pytest.approx(100 - 3 * 20 * math.sin(0.6), abs=3)
    assert columns.max() < 105
    rows, columns = drawn(GazeView(gaze=read(DOWN))).T
    assert rows.max() == pytest.approx(60 + 3 * 20 * math.sin(0.6), abs=3)
    rows, columns = drawn(GazeView(gaze=read(AT_THE_CAMERA))).T
    assert max(np.ptp(rows), np.ptp(columns)) < 6, 'of one who looks into the camera it is a point'


def test_landmarks_are_points_in_the_enlarged_picture():
    found = drawn(GazeView(np.array([[10.0, 20.0]])), scale=2.0)
    assert found.mean(axis=0) == pytest.approx((40.5, 20.5), abs=1)


@pytest.mark.parametrize('place', [1e30, -1e30])
def test_landmarks_far_out_are_no_error(place):
    assert len(drawn(GazeView(np.array([[place, place]])))) == 0


def test_the_picture_of_the_page_shows_them():
    image = np.full((120, 200, 3), 90, np.uint8)
    camera = CameraModel.from_field_of_view(200, 120, 0.6)
    before = Picture(1, image, [FACE], None, camera, 0.0)
    view = GazeView(np.array([[30.0, 30.0]]), read(LEFT))
    after = Picture(1, image, [FACE], None, camera, 0.0, view)
    assert before.jpeg() != after.jpeg()


def scene(face, gaze=None):
    posture = np.zeros(2)
    return SceneView(
        (0.3, 0.2), np.full(2, -1.0), np.ones(2), posture, None, [face],
        directions_of_rays(posture, np.array([face.ray])), gaze=gaze,
    )  # fmt: skip


def test_from_above_a_thing_stands_where_its_range_says():
    near = drawings.from_above(scene(FACE._replace(range_m=0.5, range_deviation_m=0.01)))
    assert 'cy="-0.500"><title>face, 0.50 m' in near
    assert 'cy="-1.000"><title>face<' in drawings.from_above(scene(FACE))
    far = drawings.from_above(scene(FACE._replace(range_m=80.0, range_deviation_m=1.0)))
    assert float(re.search(r'cy="(\S+)"><title>face', far)[1]) > -1.4, 'it stays on the drawing'


def test_from_above_her_gaze_leaves_her_face():
    def line(gaze):
        found = re.search(
            r'class="gaze" x1="(\S+)" y1="(\S+)" x2="(\S+)" y2="(\S+)"',
            drawings.from_above(scene(FACE, np.array(gaze))),
        )
        return [float(each) for each in found.groups()]

    assert line(AT_THE_CAMERA) == pytest.approx([0, -1, 0, 0], abs=1e-3)
    # The left of the drawing is the robot's left, as positive yaw is.
    assert line((math.pi / 2, 0.0)) == pytest.approx([0, -1, -1, -1], abs=1e-3)
    assert 'class="gaze"' not in drawings.from_above(scene(FACE))
