"""What CameraInfo says about geometry is obeyed, or refused with the reason."""

import math
from dataclasses import replace

import pytest

from ja_common.core.camera_calibration import CameraCalibration
from ja_common.core.lens import Lens

K = (500.0, 0.0, 310.0, 0.0, 505.0, 250.0, 0.0, 0.0, 1.0)
P = (450.0, 0.0, 300.0, -22.5, 0.0, 450.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0)
PLAIN = CameraCalibration(K, size=(640, 480), p=P)
NAN = math.nan


def camera(calibration, width=640, height=480, rectified=False):
    return calibration.camera(width, height, rectified)


@pytest.mark.parametrize(
    ('model', 'd', 'lens'),
    [
        ('plumb_bob', (), None),
        ('', (), None),
        ('plumb_bob', (0.0,) * 5, None),
        ('', (0.0,) * 5, None),
        ('none', (), None),
        ('plumb_bob', (0.1,) * 4, Lens((0.1,) * 4)),
        ('plumb_bob', (0.1,) * 5, Lens((0.1,) * 5)),
        ('', (0.1,) * 5, Lens((0.1,) * 5)),
        ('rational_polynomial', (0.1,) * 8, Lens((0.1,) * 8)),
        ('RATIONAL_POLYNOMIAL', (0.1,) * 14, Lens((0.1,) * 14)),
        ('thin_prism', (0.1,) * 12, Lens((0.1,) * 12)),
        ('equidistant', (0.1,) * 4, Lens((0.1,) * 4, fisheye=True)),
        ('equidistant', (0.0,) * 4, Lens((0.0,) * 4, fisheye=True)),
        ('fisheye', (0.1, 0.2, 0.3, 0.4, 0.0), Lens((0.1, 0.2, 0.3, 0.4), fisheye=True)),
        ('kannala_brandt4', (0.1,) * 4, Lens((0.1,) * 4, fisheye=True)),
    ],
)
def test_the_distortion_model_decides_how_d_is_read(model, d, lens):
    assert camera(replace(PLAIN, model=model, d=d)).lens == lens


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        (dict(model='omnidirectional', d=(0.1,) * 4), "'omnidirectional' is not known"),
        (dict(model='double_sphere'), "'double_sphere' is not known"),
        (dict(d=(0.1,) * 3), 'D holds 3 numbers'),
        (dict(d=(0.1,) * 6), 'D holds 6 numbers'),
        (dict(d=(0.1, NAN, 0, 0, 0)), 'D = .* not finite'),
        (dict(d=(math.inf,) * 5), 'not finite'),
        (dict(model='equidistant', d=()), 'needs 4 numbers in D, not 0'),
        (dict(model='equidistant', d=(0.1,) * 5), 'needs 4 numbers in D, not 5'),
        (dict(model='', d=(0.1,) * 4), 'plumb_bob and equidistant read differently'),
        (dict(k=(-1.0, *K[1:])), 'focal lengths must be positive'),
        (dict(k=(NAN, *K[1:])), 'focal lengths must be positive'),
        (dict(k=(*K[:2], NAN, *K[3:])), 'K finite'),
        (dict(k=(500.0, 0, 0, 0, 505.0, 0, 310.0, 250.0, 1.0)), 'no camera matrix'),
        (dict(k=(0.0,) * 9, p=(NAN,) * 12), 'P finite'),
        (dict(k=(0.0,) * 9, d=(0.1,) * 5), 'K is zero'),
        (dict(roi=(600, 0, 100, 100)), 'roi is 100x100 at'),
        (dict(roi=(10, 10, 0, 0)), 'roi is 0x0 at'),
    ],
)
def test_what_cannot_be_obeyed_is_refused_with_its_reason(changes, reason):
    calibration = replace(PLAIN, **changes)
    with pytest.raises(ValueError, match=reason):
        camera(calibration)
    with pytest.raises(ValueError, match=reason):
        calibration.check()


def test_all_zero_means_uncalibrated():
    calibration = CameraCalibration((0.0,) * 9)
    assert camera(calibration) is None
    assert not calibration.check()


def test_p_holds_where_k_is_zero_and_for_rectified_images():
    assert camera(replace(PLAIN, k=(0.0,) * 9)).fx == 450.0
    bent = replace(PLAIN, d=(0.1,) * 5)
    rectified = camera(bent, rectified=True)
    assert (rectified.fx, rectified.cy, rectified.lens) == (450.0, 240.0, None)
    assert camera(bent).fx == 500.0
    with pytest.raises(ValueError, match='P is zero'):
        camera(replace(bent, p=(0.0,) * 12), rectified=True)
    assert camera(replace(PLAIN, p=(0.0,) * 12), rectified=True).fx == 500.0


def test_skew_and_pixels_that_are_not_square():
    skewed = camera(replace(PLAIN, k=(500.0, 7.0, *K[2:])))
    x, y = skewed.rays([310 + 500 * 0.2 + 7 * 0.1, 250 + 505 * 0.1])
    assert (x, y) == pytest.approx((0.2, 0.1))


@pytest.mark.parametrize(
    ('binning', 'size'), [((0, 0), (640, 480)), ((2, 2), (320, 240)), ((2, 1), (320, 480))]
)
def test_binning_scales(binning, size):
    found = camera(replace(PLAIN, binning=binning), *size)
    assert found.rays([-0.5, -0.5]) == pytest.approx(camera(PLAIN).rays([-0.5, -0.5]))
    assert (found.width, found.height) == size


def test_binning_of_a_calibration_that_is_already_binned():
    found = camera(replace(PLAIN, size=(320, 240), binning=(2, 2)), 320, 240)
    assert found.fx == 500.0


def test_images_of_a_window():
    window = replace(PLAIN, roi=(100, 40, 200, 150))
    whole = camera(PLAIN)
    assert camera(window, 200, 150).rays([7, 9]) == pytest.approx(whole.rays([107, 49]))
    binned = replace(window, binning=(2, 2))
    assert camera(binned, 100, 75).rays([-0.5, -0.5]) == pytest.approx(whole.rays([99.5, 39.5]))
    assert camera(replace(PLAIN, roi=(0, 0, 640, 480))) == whole
    with pytest.raises(ValueError, match='640x480, the full size, but camera_info has a window'):
        camera(window)


@pytest.mark.parametrize('size', [(1280, 720), (480, 640), (640, 360)])
def test_images_of_another_shape_are_refused(size):
    with pytest.raises(ValueError, match='another shape'):
        camera(PLAIN, *size)


@pytest.mark.parametrize('size', [(320, 240), (1280, 960), (213, 160), (640, 484)])
def test_images_of_another_size_are_scaled_with_rounding(size):
    assert camera(PLAIN, *size).fx == pytest.approx(500 * size[0] / 640)


def test_a_calibration_without_a_size_is_that_of_the_images():
    assert camera(replace(PLAIN, size=(0, 0)), 320, 240).fx == 500.0
