"""What the head's own motion does to the image, against the digital head's true perspective."""

import cv2
import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.geometry import directions_of_rays, head_rotation, rays_of_directions
from ja_common.core.lens import Lens
from ja_perception.core.ego_motion import expected_image, rotation_homography
from ja_perception.core.undistortion import distort_mask, undistort_image

CAMERA = CameraModel.from_field_of_view(160, 120, np.radians(36))


def turn(now, before=(0, 0)):
    """Return H from one posture to another."""
    return rotation_homography(CAMERA, head_rotation(now), head_rotation(before))


def test_homography_moves_pixels_as_the_geometry_does():
    before, now = np.radians([3.0, -4.0]), np.radians([8.0, 2.0])
    pixels = np.array([[20.0, 30.0], [80.0, 60.0], [150.0, 10.0]])
    directions = directions_of_rays(before, CAMERA.rays(pixels))
    expected = CAMERA.pixels(rays_of_directions(now, directions))
    moved = cv2.perspectiveTransform(pixels[None], turn(now, before))[0]
    assert moved == pytest.approx(expected, abs=1e-6)


def test_expected_image_shifts_and_knows_what_was_out_of_view():
    image = np.ones((120, 160), np.uint8)
    image[55:65, 75:85] = 200
    pan = np.arctan(30 / CAMERA.fx)
    warped = expected_image(image, turn((pan, 0)))
    # A turn to the left by 30 px moves the scene to the right, and shows 30 px never seen.
    rows, columns = np.nonzero(warped > 100)
    assert columns.mean() == pytest.approx(79.5 + 30, abs=0.5)
    assert rows.mean() == pytest.approx(59.5, abs=0.5)
    assert not warped[:, :27].any()
    assert warped[5:115, 40:].all()


def test_nothing_is_expected_after_a_turn_away():
    image = np.full((120, 160), 77, np.uint8)
    assert not expected_image(image, turn((2.5, 0))).any()


@pytest.mark.parametrize('posture_deg', [(0, 0), (0.4, -0.3), (-0.7, 0.2), (1.5, 1.0), (12, -8)])
def test_every_pixel_comes_from_where_perspective_says(posture_deg):
    # The value of each pixel is its own place: its column, and then its row.
    homography = turn(np.radians(posture_deg))
    rows, columns = np.indices((120, 160)).astype(np.uint8) + np.uint8(1)
    rows_from, columns_from = (expected_image(i, homography) for i in (rows, columns))
    seen = (rows_from > 0) & (columns_from > 0)
    pixels = np.stack([columns, rows], axis=-1)[seen] - 1.0
    came_from = cv2.perspectiveTransform(pixels[None], np.linalg.inv(homography))[0]
    found = np.stack([columns_from, rows_from], axis=-1)[seen] - 1.0
    # Half a pixel by rounding, and as much at most by what a small turn leaves out.
    assert np.abs(found - came_from).max() < 1.02
    assert seen.mean() > 0.3


def test_distortion_is_taken_out_and_put_back():
    camera = CameraModel(160, 120, 150, 150, 79.5, 59.5, Lens((-0.3, 0.05, 0.0, 0.0, 0.0)))
    mask = np.zeros((120, 160), np.uint8)
    mask[20:40, 20:50] = 1
    straight = undistort_image(mask, camera)
    assert not np.array_equal(straight, mask)
    assert (distort_mask(straight, camera) != mask).mean() < 0.01
    assert undistort_image(mask, CAMERA) is mask
