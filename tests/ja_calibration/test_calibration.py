"""Calibrations of simulated heads, compared with their true values."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from ja_calibration.calibration_file import as_dict, save
from ja_calibration.core.calibration_moves import Calibration, CalibrationConfig
from ja_calibration.core.fitted_value import FittedValue, jackknife
from ja_calibration.core.lag import Lag
from ja_calibration.core.optics import fit_gain
from ja_sim.core.specs import HEAD_PRESETS, HeadSpec
from simulated_head import calibrated, focal_lengths

IDEAL, HOBBY = HEAD_PRESETS['ideal'], HEAD_PRESETS['hobby_servo']
WIDE = replace(HOBBY, view_pan_deg=30.0, view_tilt_deg=23.0, backlash_deg=2.0)
SHORT = CalibrationConfig(loops=1, slow_rad_s=0.12, slow_swings=4, fast_swings=10)


@pytest.fixture(scope='module')
def ideal() -> Calibration:
    return calibrated(IDEAL, SHORT)


def assert_near_truth(
    found: Calibration, head: HeadSpec, signs: tuple[float, float], delay_s: float
) -> None:
    """Compare to within what encoders with steps of 0.29 degrees allow in a short run."""
    focal = [found.optics.focal_x.value, found.optics.focal_y.value]
    assert focal == pytest.approx(focal_lengths(head), rel=0.03)
    assert found.optics.signs == signs
    play = np.degrees([found.lag.backlash.value, found.optics.tilt_backlash.value])
    assert play == pytest.approx(head.backlash_deg, abs=0.15)
    assert found.lag.delay_s.value == pytest.approx(delay_s, abs=0.005)
    assert found.lag.delay_s.error < 0.005
    gains = np.array([found.pan_gain.value, found.tilt_gain.value])
    assert gains == pytest.approx(1.0, abs=0.03)


def test_an_ideal_head_is_found_exactly(ideal: Calibration) -> None:
    focal = [ideal.optics.focal_x.value, ideal.optics.focal_y.value]
    assert focal == pytest.approx(focal_lengths(IDEAL), rel=2e-3)
    assert np.degrees(ideal.lag.backlash.value) == pytest.approx(0.0, abs=0.02)
    assert ideal.lag.delay_s.value == pytest.approx(0.0, abs=0.001)
    assert ideal.optics.signs == (1.0, 1.0)


def test_a_hobby_servo_with_a_reversed_joint_and_late_pictures() -> None:
    found = calibrated(HOBBY, SHORT, signs=(-1.0, 1.0), stamps_late_s=0.05)
    # The stamps of its encoders are 10 ms late.
    assert_near_truth(found, HOBBY, (-1.0, 1.0), 0.05 - HOBBY.encoder_delay_s)


def test_a_wider_view_a_larger_play_and_the_other_joint_reversed() -> None:
    found = calibrated(WIDE, SHORT, signs=(1.0, -1.0))
    assert_near_truth(found, WIDE, (1.0, -1.0), -WIDE.encoder_delay_s)


@pytest.mark.parametrize(
    ('shown', 'complaint'),
    [
        (lambda posture: np.zeros((240, 320), np.uint8), 'only 0 points'),
        (lambda posture: PICTURE, 'does the head move'),
    ],
    ids=['the dark', 'another camera'],
)
def test_images_that_allow_no_calibration_are_refused(
    shown: Callable[[NDArray[np.float64]], NDArray[np.uint8]], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        calibrated(IDEAL, SHORT, picture_of=shown)


PICTURE = np.kron(np.random.default_rng(0).integers(0, 255, (24, 32)), np.ones((10, 10)))
PICTURE = PICTURE.astype(np.uint8)


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    samples = np.random.default_rng(0).normal(3.0, 2.0, 40)
    (mean,) = jackknife(lambda i: np.array([samples[i].mean()]), list(np.arange(40)[:, None]))
    assert mean.value == pytest.approx(samples.mean())
    assert mean.error == pytest.approx(samples.std(ddof=1) / np.sqrt(40))


def test_the_gain_is_how_far_a_joint_goes_for_a_radian() -> None:
    commanded = np.linspace(-0.1, 0.1, 9)
    assert fit_gain(commanded, 0.9 * commanded + 0.3).value == pytest.approx(0.9)


def test_the_file_holds_the_signs_and_omits_an_uncertain_delay(ideal: Calibration) -> None:
    optics = replace(ideal.optics, signs=(-1.0, 1.0))
    contents = as_dict(replace(ideal, optics=optics), (True, True), (320, 240))
    assert (contents['pan_inverted'], contents['tilt_inverted']) == (False, True)
    assert contents['camera_delay_s']['value'] == pytest.approx(0.0, abs=0.001)
    uncertain = replace(ideal, lag=Lag(FittedValue(0.03, 0.02), ideal.lag.backlash))
    assert 'camera_delay_s' not in as_dict(uncertain, (False, False), (320, 240))


def test_the_file_can_be_read(ideal: Calibration, tmp_path) -> None:
    contents = as_dict(ideal, (False, False), (320, 240))
    save(contents, tmp_path / 'head.yaml')
    assert yaml.safe_load((tmp_path / 'head.yaml').read_text()) == contents
    assert [path.name for path in tmp_path.iterdir()] == ['head.yaml']


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize(
    ('head', 'signs', 'late_s'),
    [
        (HOBBY, (1.0, 1.0), 0.0),
        (HOBBY, (-1.0, 1.0), 0.05),
        (WIDE, (1.0, -1.0), -0.03),
    ],
    ids=['hobby', 'pan reversed, pictures 50 ms late', 'wide, play 2 deg, tilt reversed'],
)
def test_the_whole_calibration_finds_the_truth(
    head: HeadSpec, signs: tuple[float, float], late_s: float, seed: int
) -> None:
    """Print the lines of the table in docs/deploy.md (with -s)."""
    found = calibrated(head, CalibrationConfig(), signs, late_s, seed=seed)
    optics, lag = found.optics, found.lag
    off = np.array([optics.focal_x.value, optics.focal_y.value]) / focal_lengths(head) - 1
    play = np.degrees([lag.backlash.value, optics.tilt_backlash.value])
    gains = np.array([found.pan_gain.value, found.tilt_gain.value])
    print(f'\nfocal lengths off by {100 * off} %, play {play} deg, gains {gains},')
    print(f'delay {1e3 * lag.delay_s.value:.1f} +- {1e3 * lag.delay_s.error:.1f} ms')
    assert_near_truth(found, head, signs, late_s - head.encoder_delay_s)
    assert off == pytest.approx(0.0, abs=0.02)
    assert gains == pytest.approx(1.0, abs=0.02)
