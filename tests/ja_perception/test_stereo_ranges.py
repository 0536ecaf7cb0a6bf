"""The depth of regions by a second camera, on drawn pairs with known disparities."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from ja_common.core.camera_calibration import CameraCalibration
from ja_common.core.camera_model import CameraModel
from ja_common.core.lens import Lens
from ja_perception.core.box import Box
from ja_perception.core.ranging import ImageRegion
from ja_perception.core.stereo_ranges import SecondView, pair_geometry

FOCAL_PX, BASELINE_M = 500.0, 0.06
CAMERA = CameraModel(320, 240, FOCAL_PX, FOCAL_PX, 159.5, 119.5)
PLACE = (200, 120)  # of the thing in the image
RADIUS = 20


def texture(seed, size=(320, 240), finest_px=6.0):
    """Return a function of columns and rows: a smooth texture in colour, known between pixels."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(0, 2 * np.pi / finest_px / 2, (3, 12, 2))
    phases = rng.uniform(0, 2 * np.pi, (3, 12))

    def at(u, v):
        layers = [
            sum(np.cos(a * u + b * v + p) for (a, b), p in zip(wave, phase, strict=True))
            for wave, phase in zip(waves, phases, strict=True)
        ]
        return 128 + 20 * np.stack(layers, axis=-1)

    return at


def pair(disparity, thing=None, wall=None, wall_disparity=8.0, radius=RADIUS):
    """Return the image and the second camera's picture of a disc before a wall."""
    thing, wall = thing or texture(1), wall or texture(2)
    u, v = np.meshgrid(np.arange(320.0), np.arange(240.0))
    pictures = []
    for shift, wall_shift in ((0.0, 0.0), (disparity, wall_disparity)):
        own = np.hypot(u + shift - PLACE[0], v - PLACE[1]) <= radius
        picture = np.where(own[..., None], thing(u + shift, v), wall(u + wall_shift, v))
        pictures.append(np.clip(np.rint(picture), 0, 255).astype(np.uint8))
    return pictures


def disc_region(place=PLACE, radius=RADIUS):
    mask = np.zeros((radius, radius), np.uint8)
    cv2.circle(mask, (radius // 2, radius // 2), radius // 2 - 1, 1, -1)
    return ImageRegion(Box(*place, 2 * radius, 2 * radius), mask)


def depth_of(left, right, region=None, **more):
    view = SecondView(right, FOCAL_PX * BASELINE_M, **more)
    (found,) = view.depths(left, [region or disc_region()], CAMERA)
    return found


def depth_at(disparity):
    return FOCAL_PX * BASELINE_M / disparity


@pytest.mark.parametrize('disparity', [20.0, 25.25, 30.5, 41.7])
def test_depth_of_a_textured_thing_to_a_part_of_a_pixel(disparity):
    depth, deviation = depth_of(*pair(disparity))
    assert FOCAL_PX * BASELINE_M / depth == pytest.approx(disparity, abs=0.2)
    # A quarter of a pixel, or 1 %, whichever is more; and not much more.
    assert 0.01 * depth <= deviation <= 0.03 * depth


def test_the_deviation_grows_with_the_distance_and_the_noise():
    near, far = (depth_of(*pair(d))[1] / depth_at(d) for d in (40.0, 12.0))
    assert far > 1.5 * near
    left, right = pair(30.0)
    noise = np.random.default_rng(3).normal(0, 30, right.shape)
    noisy = np.clip(right + noise, 0, 255).astype(np.uint8)
    depth, deviation = depth_of(left, noisy)
    assert abs(depth - depth_at(30.0)) < 2 * deviation
    assert deviation > 1.1 * depth_of(left, right)[1]


def test_a_plain_thing_in_colour_is_matched_by_its_shape():
    plain = lambda u, v: np.broadcast_to([210.0, 30.0, 40.0], (*u.shape, 3))  # noqa: E731
    depth, _ = depth_of(*pair(30.0, thing=plain))
    assert depth == pytest.approx(depth_at(30.0), rel=0.02)


def test_other_exposure_of_the_second_camera_does_not_matter():
    left, right = pair(30.0)
    darker = np.clip(0.6 * right.astype(float) + 20, 0, 255).astype(np.uint8)
    assert depth_of(left, darker)[0] == pytest.approx(depth_at(30.0), rel=0.02)


def test_a_texture_that_repeats_is_found_at_several_places_and_gives_nothing():
    stripes = lambda u, v: np.repeat(  # noqa: E731
        (128 + 90 * np.sign(np.sin(2 * np.pi * (u + 0.5) / 12)))[..., None], 3, axis=-1
    )
    left, right = pair(30.0, thing=stripes, wall=stripes, wall_disparity=30.0)
    assert np.isnan(depth_of(left, right)).all()


def test_without_contrast_there_is_nothing():
    grey = np.random.default_rng(4).integers(127, 129, (240, 320, 3)).astype(np.uint8)
    assert np.isnan(depth_of(grey, np.roll(grey, -30, axis=1))).all()


def test_what_the_second_camera_does_not_see_gives_nothing():
    left, right = pair(30.0)
    _, empty = pair(30.0, radius=0)
    assert np.isnan(depth_of(left, empty)).all()
    moved = np.roll(left, -180, axis=1)  # at the left edge: beyond the other one's view
    assert np.isnan(
        depth_of(moved, np.roll(right, -180, axis=1)[:, ::1], disc_region((20, 120)))
    ).all()


def test_a_twin_of_the_thing_is_not_taken_for_it():
    """The second camera sees only the twin, which is matched with the twin in the image."""
    thing = texture(5)
    left, _ = pair(0.0, thing=thing)
    _, right = pair(0.0, radius=0)
    u, v = np.meshgrid(np.arange(-RADIUS, RADIUS + 1.0), np.arange(-RADIUS, RADIUS + 1.0))
    own = np.hypot(u, v) <= RADIUS
    twin = thing(u + PLACE[0], v + PLACE[1]) + np.random.default_rng(6).normal(
        0, 14, (*u.shape, 3)
    )
    twin = np.clip(twin, 0, 255).astype(np.uint8)
    for picture, centre in ((left, 140), (right, 110)):
        part = picture[120 - RADIUS : 121 + RADIUS, centre - RADIUS : centre + RADIUS + 1]
        part[own] = twin[own]
    assert depth_of(left, right, disc_region((140, 120)))[0] == pytest.approx(
        depth_at(30), rel=0.02
    )
    assert np.isnan(depth_of(left, right)).all()


def test_a_row_of_misalignment_is_bridged():
    left, right = pair(30.0)
    assert depth_of(left, np.roll(right, 1, axis=0))[0] == pytest.approx(depth_at(30.0), rel=0.02)


def test_the_optical_axes_may_be_offset():
    left, right = pair(30.0)
    assert depth_of(left, right, offset_px=6.0)[0] == pytest.approx(depth_at(24.0), rel=0.02)


def test_nothing_nearer_than_the_nearest_is_looked_for():
    left, right = pair(60.0)
    assert depth_of(left, right)[0] == pytest.approx(depth_at(60.0), rel=0.02)
    assert not depth_of(left, right, nearest_m=0.7)[0] < 0.7


@pytest.mark.parametrize('turns', [1, 2, 3])
def test_cameras_that_hang_turned_give_the_same_depths(turns):
    left, right = pair(30.0)
    expected = depth_of(left, right)
    upright = [np.ascontiguousarray(np.rot90(each, -turns)) for each in (left, right)]
    box, mask = disc_region()
    width, height = 320, 240
    for _ in range(turns):  # clockwise
        box = Box(height - 1 - box.v, box.u, box.height, box.width)
        mask = np.ascontiguousarray(np.rot90(mask, -1))
        width, height = height, width
    found = depth_of(*upright, ImageRegion(box, mask), quarter_turns=turns)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_regions_at_and_beyond_the_edge_do_no_harm():
    left, right = pair(30.0)
    places = [(0, 0), (319, 239), (-100, 50), (500, 50), (160, -60), (2, 120)]
    regions = [disc_region(place) for place in places]
    regions += [ImageRegion(Box(160, 120, 1, 1)), ImageRegion(Box(160, 120, 640, 480))]
    found = SecondView(right, FOCAL_PX * BASELINE_M).depths(left, regions, CAMERA)
    assert np.isnan(found[[0, 2, 3, 4, 5, 6]]).all()
    # A quarter of the disc is in the image, and shows the wall.
    assert found[1, 0] == pytest.approx(depth_at(8.0), rel=0.05)
    assert found.shape == (8, 2)


def test_pictures_of_two_sizes_are_refused():
    with pytest.raises(ValueError, match='second camera is 160x120, but the image 320x240'):
        depth_of(np.zeros((240, 320, 3), np.uint8), np.zeros((120, 160, 3), np.uint8))


def calibration(p3=-FOCAL_PX * BASELINE_M, focal=FOCAL_PX, cx=159.5, d=(0.0,) * 5):
    k = (focal, 0.0, cx, 0.0, focal, 119.5, 0.0, 0.0, 1.0)
    p = (focal, 0.0, cx, p3, 0.0, focal, 119.5, 0.0, 0.0, 0.0, 1.0, 0.0)
    return CameraCalibration(k, d, 'plumb_bob', p, (320, 240))


def test_baseline_and_offset_come_from_p():
    focal_baseline, offset_px = pair_geometry(CAMERA, calibration(cx=150.0), rectified=False)
    assert focal_baseline == pytest.approx(FOCAL_PX * BASELINE_M)
    assert offset_px == pytest.approx(9.5)
    half = CAMERA.resized(160, 120)
    assert pair_geometry(half, calibration(), False)[0] == pytest.approx(15.0)


@pytest.mark.parametrize(
    ('left', 'right', 'reason'),
    [
        (CAMERA, calibration(p3=0.0), 'no baseline to the right'),
        (CAMERA, calibration(p3=30.0), 'swap left and right'),
        (CAMERA, calibration(p3=float('nan')), 'no baseline'),
        (CAMERA, calibration(p3=float('-inf')), 'no baseline'),
        (CAMERA, calibration(focal=400.0), 'not rectified as a pair'),
        (CAMERA, calibration(d=(0.1, 0.0, 0.0, 0.0, 0.0)), 'without lens distortion'),
        (replace(CAMERA, lens=Lens((0.1, 0.0, 0.0, 0.0))), calibration(), 'without lens'),
        (CAMERA, CameraCalibration((0.0,) * 9), 'not calibrated'),
        (CAMERA, replace(calibration(), p=(0.0,) * 12), 'not calibrated'),
    ],
)
def test_a_pair_that_cannot_be_used_is_named(left, right, reason):
    with pytest.raises(ValueError, match=reason):
        pair_geometry(left, right, rectified=False)


def test_distortion_of_the_raw_images_does_not_matter_to_rectified_ones():
    distorted = calibration(d=(0.1, 0.0, 0.0, 0.0, 0.0))
    assert pair_geometry(CAMERA, distorted, rectified=True)[0] == pytest.approx(30.0)
