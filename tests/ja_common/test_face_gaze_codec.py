"""Head pose and eyes on the wire."""

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from ja_common.core.face_gaze import FaceGaze
from ja_common.detection_codec import FIELDS as DETECTION_FIELDS
from ja_common.detection_codec import decode_detections
from ja_common.face_gaze_codec import FIELDS, decode_face_gaze, encode_face_gaze
from ja_common.point_cloud_codec import encode_columns

NAN = float('nan')
GAZE = FaceGaze(np.array([0.3, -0.1, 0.02]), 0.03, np.array([[0.1, 0.05], [NAN, NAN]]), 0.04)


def _message(**changed: float) -> PointCloud2:
    values = dict.fromkeys(FIELDS, 0.1) | {'left_visible': 1.0, 'right_visible': 1.0} | changed
    return encode_columns(Header(), {name: [value] for name, value in values.items()})


def test_there_and_back():
    found = decode_face_gaze(encode_face_gaze(Header(), GAZE))
    for before, after in zip(GAZE, found, strict=True):
        np.testing.assert_allclose(after, before, atol=1e-6)
    assert found.visible.tolist() == [True, False]


def test_the_mirror_swaps_eyes_and_the_signs_of_yaw_and_roll():
    found = GAZE.mirrored()
    np.testing.assert_allclose(found.head, [-0.3, -0.1, -0.02])
    np.testing.assert_allclose(found.eyes, [[NAN, NAN], [-0.1, 0.05]])
    np.testing.assert_allclose(found.mirrored().eyes, GAZE.eyes)


@pytest.mark.parametrize(
    'changed',
    [{'head_yaw': NAN}, {'head_pitch': 4.0}, {'left_yaw': NAN}, {'eye_deviation': np.inf}],
)
def test_what_is_no_angle_is_refused(changed: dict[str, float]):
    with pytest.raises(ValueError, match='not between'):
        decode_face_gaze(_message(**changed))


def test_an_eye_that_is_not_visible_has_no_angle():
    found = decode_face_gaze(_message(left_visible=0.0, left_yaw=7.0))
    assert found.visible.tolist() == [False, True]


def test_two_faces_are_refused():
    two = encode_columns(Header(), {name: [0.1, 0.2] for name in FIELDS})
    with pytest.raises(ValueError, match='2 faces'):
        decode_face_gaze(two)


def _detection(**columns: float) -> PointCloud2:
    values = dict.fromkeys(DETECTION_FIELDS, 0.0) | columns
    return encode_columns(Header(), {name: [value] for name, value in values.items()})


def test_detections_without_the_fields_of_the_senses_have_no_range():
    (found,) = decode_detections(_detection())
    assert np.isnan(found.range).all()
    assert not found.gaze_read


@pytest.mark.parametrize('bad', [np.inf, 0.0, -1.0])
def test_a_range_is_nan_or_positive(bad: float):
    with pytest.raises(ValueError, match='range'):
        decode_detections(_detection(range_m=bad, range_deviation_m=0.1))
    (found,) = decode_detections(_detection(range_m=NAN, range_deviation_m=NAN, gaze_read=1.0))
    assert np.isnan(found.range_m)
    assert found.gaze_read
