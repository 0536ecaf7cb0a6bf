"""The depth of regions in drawn depth pictures: known planes, things, holes, edges."""

import cv2
import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind
from ja_common.core.posture import Posture
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.box import Box
from ja_perception.core.depth_ranges import DepthPicture
from ja_perception.core.detector import SalientFeatureDetector
from ja_perception.core.ranging import ImageRegion, add_ranges, face_region
from synthetic_pictures import draw_ball, draw_face, room

CAMERA = CameraModel.from_field_of_view(320, 240, np.radians(36))
IMAGE = np.zeros((240, 320, 3), np.uint8)
BACKGROUND_M, THING_M = 2.7, 0.8


def scene(mask=None, depth_m=THING_M):
    """Return a depth picture of a wall, and of a thing where the mask (240, 320) is set."""
    depth = np.full((240, 320), BACKGROUND_M, np.float32)
    if mask is not None:
        depth[mask > 0] = depth_m
    return depth


def drawn(draw, *shape, **how):
    mask = np.zeros((240, 320), np.uint8)
    draw(mask, *shape, 1, **how)
    return mask


def region_of(mask, reduced=2):
    """Return the region of a mask (240, 320) as the detector has it: of a reduced image."""
    small = mask[reduced // 2 :: reduced, reduced // 2 :: reduced]
    x, y, width, height = cv2.boundingRect(small)
    box = Box(x + (width - 1) / 2, y + (height - 1) / 2, width, height).scaled(reduced)
    return ImageRegion(box, np.ascontiguousarray(small[y : y + height, x : x + width]))


def depth_of(depth, region, unit_m=1.0):
    (found,) = DepthPicture(depth, unit_m).depths(IMAGE, [region], CAMERA)
    return found


DISC = drawn(cv2.circle, (150, 110), 20, thickness=-1)
RING = drawn(cv2.circle, (150, 110), 30, thickness=5)
POLE = drawn(cv2.line, (100, 40), (140, 190), thickness=3)


@pytest.mark.parametrize('mask', [DISC, RING, POLE], ids=['disc', 'ring', 'thin pole'])
def test_a_thing_in_front_of_a_wall_has_its_own_depth(mask):
    depth, deviation = depth_of(scene(mask), region_of(mask))
    assert depth == pytest.approx(THING_M)
    assert 0 < deviation < 0.02 * THING_M


@pytest.mark.parametrize('mask', [DISC, RING], ids=['disc', 'ring'])
def test_pixels_at_the_rim_that_mix_thing_and_wall_do_not_count(mask):
    rng = np.random.default_rng(0)
    edge = mask - cv2.erode(mask, np.ones((3, 3), np.uint8))
    depth = scene(mask)
    depth[edge > 0] = rng.uniform(THING_M, BACKGROUND_M, (240, 320)).astype(np.float32)[edge > 0]
    assert depth_of(depth, region_of(mask))[0] == pytest.approx(THING_M)


def test_deviation_follows_the_noise_of_the_sensor():
    noise = np.random.default_rng(1).normal(0, 0.03, (240, 320)).astype(np.float32)
    depth, deviation = depth_of(scene(DISC) + noise, region_of(DISC))
    assert depth == pytest.approx(THING_M, abs=0.01)
    assert deviation == pytest.approx(0.03, rel=0.3)


@pytest.mark.parametrize('hole', [np.nan, 0.0, -1.0, np.inf, -np.inf])
def test_holes_are_left_out_and_too_many_leave_nothing(hole):
    rng = np.random.default_rng(2).random((240, 320))
    depth = scene(DISC)
    depth[rng < 0.7] = hole
    assert depth_of(depth, region_of(DISC))[0] == pytest.approx(THING_M)
    depth[rng < 0.95] = hole
    assert np.isnan(depth_of(depth, region_of(DISC))).all()
    depth[:] = hole
    assert np.isnan(depth_of(depth, region_of(DISC))).all()


def test_a_slanted_surface_has_the_depth_of_its_middle():
    slope = np.linspace(-0.1, 0.1, 41, dtype=np.float32)
    depth = scene(DISC)
    depth[90:131, 130:171] = np.where(DISC[90:131, 130:171] > 0, THING_M + slope, BACKGROUND_M)
    found, deviation = depth_of(depth, region_of(DISC))
    assert found == pytest.approx(THING_M, rel=0.02)
    assert deviation > 0.03


def test_a_thing_that_is_partly_hidden_keeps_its_depth():
    near = drawn(cv2.rectangle, (120, 80), (148, 140), thickness=-1)
    depth = scene(DISC)
    depth[near > 0] = 0.5
    behind = DISC * (1 - near)
    assert depth_of(depth, region_of(behind))[0] == pytest.approx(THING_M)
    assert depth_of(depth, region_of(near))[0] == pytest.approx(0.5)


def test_in_a_box_without_known_pixels_the_nearest_surface_counts():
    box = ImageRegion(Box(150, 110, 41, 41))
    thin = drawn(cv2.rectangle, (140, 80), (155, 140), thickness=-1)  # 39 % of the box
    assert depth_of(scene(thin), box)[0] == pytest.approx(THING_M)
    few = drawn(cv2.rectangle, (140, 80), (143, 140), thickness=-1)  # 10 %
    assert depth_of(scene(few), box)[0] == pytest.approx(BACKGROUND_M)


def test_the_corners_of_the_box_of_a_face_do_not_count():
    face = Box(150, 110, 60, 60)
    depth = scene(drawn(cv2.ellipse, (150, 110), (22, 26), 0, 0, 360, thickness=-1), 1.2)
    depth[80:141, 119:138] = THING_M  # something before a part of the box
    assert depth_of(depth, face_region(face))[0] == pytest.approx(1.2)


@pytest.mark.parametrize('kind', ['<u2', '>u2', '<f4', '>f4'])
def test_millimetres_and_metres_of_either_byte_order_agree(kind):
    whole = 'u' in kind
    samples = (scene(DISC) * (1000 if whole else 1)).round(3).astype(kind)
    found = depth_of(samples, region_of(DISC), 0.001 if whole else 1.0)
    assert found[0] == pytest.approx(THING_M, abs=1e-3)


@pytest.mark.parametrize('size', [(160, 120), (640, 480), (424, 318)])
def test_a_depth_picture_of_another_size_is_read_at_the_same_places(size):
    depth = cv2.resize(scene(DISC), size, interpolation=cv2.INTER_NEAREST)
    moved = drawn(cv2.circle, (205, 110), 20, thickness=-1)
    assert depth_of(depth, region_of(DISC))[0] == pytest.approx(THING_M)
    assert depth_of(depth, region_of(moved))[0] == pytest.approx(BACKGROUND_M)


def test_another_shape_is_refused():
    with pytest.raises(ValueError, match='320x180, but the image 320x240'):
        depth_of(np.ones((180, 320), np.float32), region_of(DISC))


def test_regions_at_and_beyond_the_edge():
    depth = scene(drawn(cv2.rectangle, (0, 90), (20, 130), thickness=-1))
    found = DepthPicture(depth).depths(
        IMAGE, [ImageRegion(Box(u, 110, 30, 30)) for u in (5, -40, 400)], CAMERA
    )
    assert found[0, 0] == pytest.approx(THING_M)
    assert np.isnan(found[1:]).all()


@pytest.mark.parametrize('depth_m', [np.nan, np.inf, 0.0, -1.0, 1e-40, 3e38])
def test_a_depth_that_no_sensor_measures_is_no_range(depth_m):
    ball = Detection(Kind.OBJECT, 0.1, 0.2, 150, 110, 30, 30, 0.5)
    assert add_ranges([ball], np.array([[depth_m, 0.01]])) == [ball]


def test_detections_get_the_range_along_their_ray():
    picture = room()
    draw_face(picture, 160, 120, 80)
    draw_ball(picture, 280, 60, 14)
    depth = np.full((240, 320), BACKGROUND_M, np.float32)
    cv2.circle(depth, (280, 60), 14, THING_M, -1)
    cv2.circle(depth, (160, 120), 40, 1.2, -1)
    posture = Posture(1, np.zeros(2), np.zeros(2))
    detector = SalientFeatureDetector(BlazeFace())
    face, ball = detector.detect(picture, 1, CAMERA, posture, DepthPicture(depth)).detections
    assert face.kind is Kind.FACE
    for detection, z in ((face, 1.2), (ball, THING_M)):
        along = z * np.linalg.norm([*detection.ray, 1.0])
        assert detection.range_m == pytest.approx(along, rel=1e-6)
        assert 0 < detection.range_deviation_m < 0.05 * along
    assert ball.range_m > THING_M * 1.03
    without = SalientFeatureDetector(BlazeFace()).detect(picture, 1, CAMERA, posture).detections
    assert [each._replace(range_m=0, range_deviation_m=0) for each in without] == [
        each._replace(range_m=0, range_deviation_m=0) for each in (face, ball)
    ]
    assert all(np.isnan(each.range).all() for each in without)
