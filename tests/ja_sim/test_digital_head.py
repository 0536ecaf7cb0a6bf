"""The digital pan-tilt head: servos and the perspective of a turned camera."""

import numpy as np
import pytest

from ja_common.core.geometry import rays_of_directions
from ja_sim.core.digital_head import DigitalHead, DigitalHeadConfig

SECOND = 1_000_000_000
WIDE_FOCAL = 320 / np.tan(np.radians(30))  # 640 px across 60 degrees


def wide_with_dot(direction):
    """Return a 640x480 picture, black but for a dot at a direction (pan, tilt) [rad]."""
    x, y = rays_of_directions((0, 0), direction)
    rows, columns = np.indices((480, 640))
    distance = np.hypot(columns - 319.5 - WIDE_FOCAL * x, rows - 239.5 - WIDE_FOCAL * y)
    return (255 * np.clip(4 - distance, 0, 1)).astype(np.uint8)


def centroid(picture):
    rows, columns = np.indices(picture.shape)
    return np.array([(columns * picture).sum(), (rows * picture).sum()]) / picture.sum()


def settled(head, posture, wide):
    head.command(posture)
    head.render_view(wide, SECOND)
    return head.render_view(wide, 3 * SECOND)


@pytest.mark.parametrize('posture', [(0, 0), (0.2, 0), (-0.3, 0.1), (0.25, -0.2)])
def test_what_is_in_the_direction_of_the_posture_stands_in_the_centre(posture):
    view, reached = settled(DigitalHead(), posture, wide_with_dot(posture))
    assert reached.position == pytest.approx(posture, abs=1e-6)
    assert view.shape == (240, 320)
    assert centroid(view) == pytest.approx((159.5, 119.5), abs=0.1)


def test_perspective_is_that_of_a_turned_camera():
    head, posture, dot = DigitalHead(), (0.15, -0.1), (0.35, 0.02)
    view, _ = settled(head, posture, wide_with_dot(dot))
    expected = (159.5, 119.5) + head.focal_px * rays_of_directions(posture, dot)
    assert centroid(view) == pytest.approx(expected, abs=0.15)


def test_wide_picture_of_many_pixels_is_shrunk_without_shift():
    wide = np.kron(wide_with_dot((0.1, 0.1)), np.ones((4, 4), np.uint8))
    view, _ = settled(DigitalHead(), (0.1, 0.1), wide)
    assert centroid(view) == pytest.approx((159.5, 119.5), abs=0.2)


def test_servo_cruises_at_its_speed_and_comes_to_rest():
    head = DigitalHead(DigitalHeadConfig(speed_rad_s=1.0, time_constant_s=0.05))
    wide = np.zeros((480, 640), np.uint8)
    head.render_view(wide, 0)
    head.command((0.4, 0.0))
    _, moving = head.render_view(wide, SECOND // 10)
    assert moving.position == pytest.approx((0.1, 0.0))
    assert moving.velocity == pytest.approx((1.0, 0.0))
    _, resting = head.render_view(wide, 2 * SECOND)
    assert resting.position == pytest.approx((0.4, 0.0), abs=1e-6)
    assert abs(resting.velocity).max() < 1e-6


def test_motion_does_not_depend_on_the_rate_of_images():
    wide = np.zeros((480, 640), np.uint8)
    positions = []
    for images in (1, 7):
        head = DigitalHead(DigitalHeadConfig(speed_rad_s=2.0, time_constant_s=0.1))
        head.render_view(wide, 0)
        head.command((0.45, -0.1))
        for k in range(1, images + 1):
            _, posture = head.render_view(wide, k * SECOND // (4 * images))
        positions.append(posture.position)
    assert positions[0] == pytest.approx(positions[1], abs=1e-9)


def test_stops_where_the_wide_picture_ends():
    _, posture = settled(DigitalHead(), (2.0, -2.0), np.zeros((480, 640), np.uint8))
    assert posture.position == pytest.approx(
        (np.radians(30), -np.arctan(0.75 * np.tan(np.radians(30)))), abs=1e-6
    )


@pytest.mark.parametrize('posture', [(np.nan, 0), (0,), (np.inf, 0)])
def test_impossible_command_is_refused_and_the_old_one_holds(posture):
    head, wide = DigitalHead(), np.zeros((480, 640), np.uint8)
    head.command((0.1, 0.1))
    with pytest.raises(ValueError, match='two finite numbers'):
        head.command(posture)
    assert settled(head, (0.1, 0.1), wide)[1].position == pytest.approx((0.1, 0.1), abs=1e-6)


def test_window_must_be_narrower_than_the_wide_picture():
    with pytest.raises(ValueError, match='narrower'):
        DigitalHead(DigitalHeadConfig(wide_view_rad=0.5))
