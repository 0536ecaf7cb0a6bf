"""Pixels and rays."""

import math

import cv2
import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.lens import WIDEST_RAD, Lens

BROWN = Lens((-0.3, 0.1, 0.001, -0.002, 0.0))
RATIONAL = Lens((0.53, -2.63, 0.0008, -0.0003, 1.52, 0.41, -2.46, 1.45))
THIN_PRISM = Lens((-0.2, 0.05, 0.001, -0.002, 0.0, 0.0, 0.0, 0.0, 0.003, -0.001, 0.002, 0.001))
TILTED = Lens((*THIN_PRISM.coefficients, 0.02, -0.03))
FISHEYE = Lens((-0.013, 0.008, -0.006, 0.001), fisheye=True)
# A distorted camera as a calibration gives it.
BENT = CameraModel(640, 480, 500, 505, 310, 250, BROWN)
LENSES = {'4': Lens(BROWN.coefficients[:4]), '5': BROWN, '8': RATIONAL, '12': THIN_PRISM,
          '14': TILTED, 'fisheye': FISHEYE}  # fmt: skip
PIXELS = np.array([[3.0, 5.0], [33.0, 400.0], [310.0, 250.0], [600.0, 10.0], [320.5, 239.5]])


def camera_with(lens, skew=(0.0, 0.0)):
    return CameraModel(640, 480, 500, 420, 310, 250, lens, skew)


def test_field_of_view_spans_the_image_from_edge_to_edge():
    camera = CameraModel.from_field_of_view(320, 240, math.radians(36))
    left_edge, right_edge = camera.rays([[-0.5, 119.5], [319.5, 119.5]])
    assert left_edge == pytest.approx([-math.tan(math.radians(18)), 0])
    assert right_edge == pytest.approx([math.tan(math.radians(18)), 0])
    assert camera.half_view_rad[0] == pytest.approx(math.radians(18))


@pytest.mark.parametrize('lens', [None, *LENSES.values()], ids=['ideal', *LENSES])
@pytest.mark.parametrize('turns', range(4))
@pytest.mark.parametrize('skew', [(0.0, 0.0), (3.0, 0.0)])
def test_rays_and_pixels_are_inverse(lens, turns, skew):
    camera = camera_with(lens, skew).turned(turns)
    pixels = PIXELS if turns % 2 == 0 else PIXELS[:, ::-1]
    assert camera.pixels(camera.rays(pixels)) == pytest.approx(pixels, abs=1e-3)


@pytest.mark.parametrize('name', ['4', '5', '8', '12', '14'])
def test_rays_are_those_of_opencv(name):
    camera = camera_with(LENSES[name])
    expected = cv2.undistortPointsIter(
        PIXELS[:, None], camera.matrix, np.array(camera.lens.coefficients), np.eye(3), np.eye(3),
        (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-9),
    )[:, 0]  # fmt: skip
    assert camera.rays(PIXELS) == pytest.approx(expected, abs=1e-6)


def test_rays_of_a_fisheye_are_those_of_opencv_and_not_those_of_plumb_bob():
    camera = camera_with(FISHEYE)
    d = np.array(FISHEYE.coefficients)
    expected = cv2.fisheye.undistortPoints(PIXELS[:, None], camera.matrix, d)[:, 0]
    assert camera.rays(PIXELS) == pytest.approx(expected, abs=1e-6)
    rays = np.array([[0.2, -0.5], [1.5, 0.3]])
    points = np.concatenate([rays, np.ones((2, 1))], axis=1)[:, None]
    seen, _ = cv2.fisheye.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, d)
    assert camera.pixels(rays) == pytest.approx(seen[:, 0], abs=1e-6)
    straight = camera_with(Lens(FISHEYE.coefficients)).rays(PIXELS[0])
    away = np.degrees(np.arctan(np.linalg.norm([camera.rays(PIXELS[0]), straight], axis=1)))
    assert abs(away[0] - away[1]) > 3


def test_what_a_fisheye_sees_behind_is_placed_at_the_widest_ray():
    camera = CameraModel(1000, 1000, 250, 250, 500, 500, Lens((0.0,) * 4, fisheye=True))
    beyond = camera.rays([500 + 250 * 1.8, 500.0])  # 103 degrees from the axis
    assert beyond == pytest.approx([math.tan(WIDEST_RAD), 0])
    assert np.isfinite(camera.pixels(beyond)).all()
    assert np.isnan(camera.pixels([np.nan, np.nan])).all()


def test_a_fisheye_polynomial_that_folds_back_stays_where_it_grows():
    camera = CameraModel(1000, 1000, 500, 500, 500, 500, Lens((-0.3, 0, 0, 0), fisheye=True))
    along = camera.rays(np.column_stack([np.linspace(500, 1000, 60), np.full(60, 500.0)]))[:, 0]
    assert (np.diff(along) >= -1e-9).all()
    assert np.isfinite(along).all()


def test_barrel_distortion_is_taken_out():
    straight = CameraModel(640, 480, 500, 505, 310, 250)
    corner = [20.0, 20.0]
    assert np.linalg.norm(BENT.rays(corner)) > np.linalg.norm(straight.rays(corner))


def test_resized_camera_sees_the_same_edges():
    camera = CameraModel(640, 480, 500, 505, 310, 250, skew=(4.0, 0.0))
    half = camera.resized(320, 240)
    assert half.rays([-0.5, 239.5]) == pytest.approx(camera.rays([-0.5, 479.5]))


def test_a_window_sees_what_the_whole_sees_there():
    window = BENT.cropped(100, 40, 200, 150)
    assert (window.width, window.height) == (200, 150)
    assert window.rays([7, 9]) == pytest.approx(BENT.rays([107, 49]))


@pytest.mark.parametrize('lens', [None, *LENSES.values()], ids=['ideal', *LENSES])
@pytest.mark.parametrize('turns', [1, 2, 3])
def test_a_turned_image_shows_a_thing_in_the_turned_direction(lens, turns):
    camera = camera_with(lens, skew=(2.0, 0.0))
    column, row = 500, 60
    picture = np.zeros((480, 640), np.uint8)
    picture[row, column] = 255
    (turned_row,), (turned_column,) = np.nonzero(np.rot90(picture, -turns))
    x, y = camera.rays([column, row])
    for _ in range(turns):
        x, y = -y, x
    turned = camera.turned(turns)
    assert turned.rays([turned_column, turned_row]) == pytest.approx([x, y], abs=1e-9)
    assert (turned.width, turned.height) == np.rot90(picture, -turns).shape[::-1]


def test_contains_the_image_but_neither_its_outside_nor_nan():
    camera = CameraModel(64, 48, 50, 50, 31.5, 23.5)
    assert camera.contains((0, 47))
    assert not camera.contains((64, 20))
    assert not camera.contains((np.nan, np.nan))
