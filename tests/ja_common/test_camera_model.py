"""Pixels and rays."""

import math

import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel

# A distorted camera as a calibration gives it: k1, k2, p1, p2, k3.
BENT = CameraModel.from_calibration(
    640, 480, [500, 0, 310, 0, 505, 250, 0, 0, 1], [-0.3, 0.1, 0.001, -0.002, 0.0]
)


def test_field_of_view_spans_the_image_from_edge_to_edge():
    camera = CameraModel.from_field_of_view(320, 240, math.radians(36))
    left_edge, right_edge = camera.rays([[-0.5, 119.5], [319.5, 119.5]])
    assert left_edge == pytest.approx([-math.tan(math.radians(18)), 0])
    assert right_edge == pytest.approx([math.tan(math.radians(18)), 0])


@pytest.mark.parametrize('camera', [CameraModel(64, 48, 50, 60, 31, 20), BENT])
def test_rays_and_pixels_are_inverse(camera):
    pixels = np.array([[3.0, 5.0], [33.0, 40.0], [60.0, 10.0]])
    assert camera.pixels(camera.rays(pixels)) == pytest.approx(pixels, abs=1e-3)


def test_barrel_distortion_is_taken_out():
    straight = CameraModel(640, 480, 500, 505, 310, 250)
    corner = [20.0, 20.0]
    assert np.linalg.norm(BENT.rays(corner)) > np.linalg.norm(straight.rays(corner))


def test_resized_camera_sees_the_same_edges():
    camera = CameraModel(640, 480, 500, 505, 310, 250)
    half = camera.resized(320, 240)
    assert half.rays([-0.5, 239.5]) == pytest.approx(camera.rays([-0.5, 479.5]))


def test_all_zero_matrix_means_uncalibrated():
    assert CameraModel.from_calibration(64, 48, [0.0] * 9) is None


@pytest.mark.parametrize('fx', [-1.0, float('nan')])
def test_impossible_focal_length_is_refused(fx):
    with pytest.raises(ValueError, match='focal'):
        CameraModel.from_calibration(64, 48, [fx, 0, 32, 0, 50, 24, 0, 0, 1])


def test_contains_the_image_but_neither_its_outside_nor_nan():
    camera = CameraModel(64, 48, 50, 50, 31.5, 23.5)
    assert camera.contains((0, 47))
    assert not camera.contains((64, 20))
    assert not camera.contains((np.nan, np.nan))
