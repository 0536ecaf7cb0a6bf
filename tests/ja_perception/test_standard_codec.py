"""The conversion to vision_msgs and hri_msgs, with stand-ins of their definitions.

`test_standard_outputs_types.py` does the same with the real classes.
"""

import math
import re

import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind
from ja_common.core.face_gaze import FaceGaze
from ja_perception.core.head_pose import _REFERENCE, HeadPose, gaze_angles
from ja_perception.standard_codec import (
    LANDMARKS,
    MESH_OF_DLIB,
    MESH_POINTS,
    crop_face_picture,
    encode_detections_2d,
    encode_landmarks,
    encode_region,
    face_id,
    face_position,
    face_rotation,
    gaze_rotation,
)
from node_bench import header
from standard_stand_ins import DEFINITIONS, HRI, VISION

HEADER = header(10**9, 'camera_optical_frame')
BALL = Detection(Kind.OBJECT, 0.1, -0.2, 20.5, 99.0, 8.0, 9.0, 1.25, 12, range_m=2.0)
FACE = Detection(Kind.FACE, 0.0, 0.1, 160.0, 119.5, 50.0, 60.0, 0.9, 3, gaze_read=True)
BLIND = np.full((2, 2), math.nan)


def gaze(yaw=0.0, pitch=0.0, roll=0.0, eyes=BLIND):
    return FaceGaze(np.array([yaw, pitch, roll]), 0.03, np.array(eyes), 0.04)


def test_boxes_classes_and_scores():
    message = encode_detections_2d(VISION, HEADER, [BALL, FACE])
    assert message.header == HEADER
    ball, face = message.detections
    assert (ball.id, face.id) == ('12', 'f3')
    assert (ball.bbox.center.position.x, ball.bbox.center.position.y) == (20.5, 99.0)
    assert (ball.bbox.size_x, ball.bbox.size_y, ball.bbox.center.theta) == (8.0, 9.0, 0.0)
    [[of_ball], [of_face]] = ball.results, face.results
    assert (of_ball.hypothesis.class_id, of_face.hypothesis.class_id) == ('object', 'face')
    assert (of_ball.hypothesis.score, of_face.hypothesis.score) == (1.0, 0.9)
    point = of_ball.pose.pose.position
    assert math.isclose(math.hypot(point.x, point.y, point.z), 2.0)
    assert math.isclose(point.x / point.z, 0.1)
    assert of_face.pose.pose.position.z == 0.0  # no range is known
    assert encode_detections_2d(VISION, HEADER, []).detections == []


def test_identifiers_begin_with_a_letter_and_are_those_of_one_head():
    assert face_id(FACE) == face_id(FACE, '/') == 'f3'
    assert face_id(FACE, '/lab/left') == 'lab_left_f3'


@pytest.mark.parametrize(
    ('u', 'v', 'expected'),
    [
        (159.5, 119.5, (135 / 320, 90 / 240, 185 / 320, 150 / 240)),
        (0.0, 0.0, (0.0, 0.0, 25.5 / 320, 30.5 / 240)),
        (319.0, 500.0, (294.5 / 320, 1.0, 1.0, 1.0)),
    ],
)
def test_regions_are_shares_of_the_picture(u, v, expected):
    region = encode_region(HRI, HEADER, FACE._replace(u=u, v=v), 320, 240)
    assert np.allclose((region.xmin, region.ymin, region.xmax, region.ymax), expected)
    assert region.c == 0.9


def test_a_crop_is_scaled_centred_and_padded():
    picture = np.zeros((240, 320, 3), np.uint8)
    picture[90:150, 135:185] = (10, 20, 30)
    crop = crop_face_picture(picture, FACE._replace(u=159.5), 128, 128)
    assert crop.shape == (128, 128, 3)
    filled = crop.any(axis=2)
    assert filled.all(axis=0).sum() == round(50 * 128 / 60)
    assert (crop[filled] == (10, 20, 30)).all()
    columns = np.flatnonzero(filled.any(axis=0))
    assert abs(columns[0] - (127 - columns[-1])) <= 1


@pytest.mark.parametrize(
    ('u', 'v', 'size', 'seen'),
    [
        (0.0, 0.0, (50.0, 60.0), True),
        (-100.0, 20.0, (50.0, 60.0), False),
        (900.0, 900.0, (50.0, 60.0), False),
        (100.0, 100.0, (0.0, 0.0), False),
        (160.0, 120.0, (5000.0, 1.0), True),
    ],
)
def test_any_box_can_be_cropped(u, v, size, seen):
    picture = np.full((240, 320, 3), 200, np.uint8)
    face = FACE._replace(u=u, v=v, width=size[0], height=size[1])
    crop = crop_face_picture(picture, face, 32, 24)
    assert crop.shape == (24, 32, 3)
    assert crop.any() == seen


def mesh():
    """Return a face mesh (468, 2) [px] that shows where each point came from."""
    index = np.arange(MESH_POINTS)
    return np.column_stack([index % 300, index // 3]).astype(float)


def test_landmarks_stand_in_the_order_of_their_codes():
    message = encode_landmarks(HRI, HEADER, mesh(), 0.8, 320, 240)
    assert len(message.landmarks) == LANDMARKS == 70
    assert (message.width, message.height) == (320, 240)
    for code, index in enumerate(MESH_OF_DLIB):
        point = message.landmarks[code]
        assert np.allclose((point.x, point.y), (mesh()[index] + 0.5) / (320, 240))
        assert point.c == 0.8
    for pupil in message.landmarks[-2:]:
        assert (pupil.x, pupil.y, pupil.c) == (0.0, 0.0, 0.0)


def test_each_visible_pupil_finds_its_eye():
    points = mesh()
    right, left = points[[33, 133]].mean(axis=0), points[[362, 263]].mean(axis=0)

    def pupils(*centres):
        irises = [np.tile(centre, (5, 1)) for centre in centres]
        message = encode_landmarks(HRI, HEADER, np.concatenate([points, *irises]), 1.0, 320, 240)
        return [(point.x * 320 - 0.5, point.y * 240 - 0.5, point.c) for point in
                message.landmarks[-2:]]  # fmt: skip

    near = np.array([1.0, 0.5])
    both = pupils(right + near, left + near)
    assert np.allclose(both, [(*right + near, 1.0), (*left + near, 1.0)])
    assert np.allclose(pupils(left + near)[1], (*left + near, 1.0))
    assert pupils(left + near)[0][2] == 0.0


def test_landmarks_outside_of_the_picture_count_for_nothing():
    points = mesh()
    points[MESH_OF_DLIB[0]] = (-5.0, 10.0)
    points[MESH_OF_DLIB[1]] = math.nan
    message = encode_landmarks(HRI, HEADER, points, 1.0, 320, 240)
    assert [point.c for point in message.landmarks[:3]] == [0.0, 0.0, 1.0]
    with pytest.raises(ValueError, match='no face mesh of 468'):
        encode_landmarks(HRI, HEADER, points[:100], 1.0, 320, 240)


def test_the_codes_of_both_sides_are_mirror_images():
    """By the names in the definition, and the mirror images that the head pose is fitted with."""
    text = (DEFINITIONS / 'hri_msgs' / 'msg' / 'FacialLandmarks.msg').read_text()
    codes = {name: int(code) for name, code in re.findall(r'^uint8 (\w+)=(\d+)', text, re.M)}
    mirror = {row[0]: row[1] for row in _REFERENCE} | {row[1]: row[0] for row in _REFERENCE}
    compared = 0
    for name, code in codes.items():
        other = name.replace('RIGHT', 'LEFT')
        if name.startswith('RIGHT') and code < len(MESH_OF_DLIB):
            index, opposite = MESH_OF_DLIB[code], MESH_OF_DLIB[codes[other]]
            if index in mirror:
                assert mirror[index] == opposite, name
                compared += 1
    assert compared >= 8
    assert len(set(MESH_OF_DLIB.tolist())) == len(MESH_OF_DLIB)


def test_a_face_that_looks_at_the_camera_has_its_axis_towards_it():
    face = FACE._replace(x=0.4, y=-0.3)
    towards = -face_position(face, 1.0)
    assert math.isclose(float(np.linalg.norm(towards)), 1.0)
    assert np.allclose(face_rotation(face, gaze())[:, 0], towards)
    assert np.allclose(gaze_rotation(face, gaze())[:, 2], towards)
    assert face_rotation(FACE, gaze())[:, 2] @ [0.0, -1.0, 0.0] > 0.9  # up
    assert np.allclose(face_position(face._replace(range_m=3.0), 1.0), -3.0 * towards)


@pytest.mark.parametrize('angles', np.random.default_rng(1).uniform(-0.7, 0.7, (10, 3)))
def test_axes_are_those_that_the_head_pose_was_measured_with(angles):
    """`HeadPose.angles` takes the axes apart again, in the view along the ray to the face."""
    camera = CameraModel.from_field_of_view(320, 240, 0.8)
    pixel = np.array([200.0, 90.0])
    x, y = camera.rays(pixel)
    axes = face_rotation(FACE._replace(x=x, y=y), gaze(*angles))
    assert np.allclose(axes @ axes.T, np.eye(3))
    assert math.isclose(np.linalg.det(axes), 1.0)
    along = np.column_stack(face_view(x, y)).T @ axes
    pose = HeadPose(np.zeros(2), np.column_stack([along[:, 1], -along[:, 2], -along[:, 0]]), 1.0)
    assert np.allclose(pose.angles, angles)


def face_view(x, y):
    """Return right, down and away of a camera that looks along a ray, without roll."""
    away = np.array([x, y, 1.0]) / math.hypot(x, y, 1.0)
    right = np.array([away[2], 0.0, -away[0]]) / math.hypot(away[0], away[2])
    return right, np.cross(away, right), away


def test_the_gaze_adds_the_mean_of_the_visible_eyes():
    eyes = [[0.2, 0.1], [math.nan, math.nan]]
    face = FACE._replace(x=0.0, y=0.0)
    axes = gaze_rotation(face, gaze(0.1, -0.3, 0.2, eyes))
    assert math.isclose(np.linalg.det(axes), 1.0)
    assert np.allclose(gaze_angles(axes[:, 2]), (0.3, -0.2))
    head = face_rotation(face, gaze(0.1, -0.3, 0.2))
    without = gaze_rotation(face, gaze(0.1, -0.3, 0.2))
    assert np.allclose(without[:, 2], head[:, 0])  # REP-155: colinear with x of the face
    assert np.allclose(without[:, 0], -head[:, 1])
