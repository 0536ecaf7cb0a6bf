"""Detector and digital head together: what is looked at comes into the centre and stays there."""

import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import caregiver_face
from ja_common.core.fixation import WIDTH_SIXTH
from ja_common.core.geometry import directions_of_rays
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import SalientFeatureDetector
from ja_sim.core.digital_head import DigitalHead
from synthetic_pictures import draw_ball, draw_face, room

FRAME_NS = 33_000_000


@pytest.fixture
def wide():
    picture = room(960, 720)
    draw_face(picture, 560, 420, 140)
    draw_ball(picture, 350, 330, 45)
    draw_ball(picture, 800, 560, 25, (30, 200, 40))
    return picture


def test_face_then_most_salient_object(wide):
    head, detector = DigitalHead(), SalientFeatureDetector(BlazeFace())
    camera = CameraModel.from_field_of_view(320, 240, np.radians(36))
    offsets = {'face': [], 'object': []}
    for number in range(60):
        what = 'face' if number < 30 else 'object'
        view, posture = head.render_view(wide, number * FRAME_NS)
        percept = detector.detect(view, posture.stamp_ns, camera, posture)
        seen = caregiver_face(percept.detections) if what == 'face' else percept.target
        assert seen is not None
        offsets[what].append(np.hypot(*seen.ray))
        direction = directions_of_rays(posture.position, seen.ray)
        head.command(posture.position + 0.5 * (direction - posture.position))
    for what, from_centre in offsets.items():
        assert from_centre[0] > 0.5 * WIDTH_SIXTH, f'{what} was in the centre at the start'
        assert max(from_centre[15:]) < 0.1 * WIDTH_SIXTH, what
    # The larger of the two balls, at its true direction in the wide picture.
    ball = np.array([350 - 479.5, 330 - 359.5]) / (480 / np.tan(np.radians(30)))
    assert posture.position == pytest.approx(directions_of_rays((0, 0), ball), abs=0.01)
