"""The moves of a calibration, in their order, and the fits that follow from them.

A generator yields one move after another; the caller sends it what was measured during the move.
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_calibration.core.fitted_value import FittedValue
from ja_calibration.core.lag import Lag, SweepRecord, fit_lag, measure_pan
from ja_calibration.core.optics import Optics, fit_gain, fit_optics
from ja_calibration.core.posed_image import PosedImage
from ja_common.core.config import Configuration, parameter


@dataclass(frozen=True)
class CalibrationConfig(Configuration):
    """How far and how fast the head moves about its first posture."""

    amplitude_rad: float = parameter(
        0.1, 'largest angle from the start, in pan and in tilt', low=0.03, high=0.3
    )
    loops: int = parameter(2, 'how often each joint goes up and down in steps', low=1, high=20)
    slow_rad_s: float = parameter(
        0.08, 'speed of the slow sweeps, which measure the backlash', low=0.01, high=1.0
    )
    fast_rad_s: float = parameter(
        0.35, 'speed of the fast sweeps, which measure the delay, and of the steps',
        low=0.02, high=2.0,
    )  # fmt: skip
    slow_swings: int = parameter(4, 'slow swings, of one way each', low=2, high=100)
    fast_swings: int = parameter(16, 'fast swings, of one way each', low=2, high=100)


@dataclass(frozen=True)
class StepMove:
    """Go to these angles (2,) [rad] and stand still; answered with the mean of several images.

    `side` (2,): the side from which each joint comes, +1 from below, -1 from above.
    """

    angles: NDArray[np.float64]
    side: NDArray[np.float64]
    speed_rad_s: float


@dataclass(frozen=True)
class SweepMove:
    """Pan to and fro about these angles, `swings` times one way; answered with a `SweepRecord`."""

    angles: NDArray[np.float64]
    amplitude_rad: float
    swings: int
    speed_rad_s: float


@dataclass(frozen=True)
class Calibration:
    """All fitted values; a gain is how far a joint turns for one radian of its command."""

    optics: Optics
    pan_gain: FittedValue
    tilt_gain: FittedValue
    lag: Lag


CalibrationMoves = Generator[StepMove | SweepMove, PosedImage | SweepRecord, Calibration]


def calibration_moves(config: CalibrationConfig, start: ArrayLike) -> CalibrationMoves:
    """Calibrate about a start (2,) [rad].

    Raises ValueError when the images do not allow it.
    """
    start = np.asarray(start, float)
    reach = config.amplitude_rad
    up = np.ones(2)
    # From below, in both joints: the backlash then lies on a known side.
    yield StepMove(start - reach / 2, -up, config.fast_rad_s)
    reference = yield StepMove(start, up, config.fast_rad_s)
    assert isinstance(reference, PosedImage)
    steps = [step for joint in (0, 1) for step in _steps(joint, start, config)]
    images = []
    for step in steps:
        image = yield step
        assert isinstance(image, PosedImage)
        images.append(image)
    optics = fit_optics(reference, images, [step.side for step in steps])
    commanded = np.array([step.angles for step in steps])
    measured = np.array([image.angles for image in images])
    pan_gain, tilt_gain = (fit_gain(commanded[:, j], measured[:, j]) for j in (0, 1))
    tracks = []
    for swings, speed in (
        (config.slow_swings, config.slow_rad_s),
        (config.fast_swings, config.fast_rad_s),
    ):
        sweep = yield SweepMove(start, reach, swings, speed)
        assert isinstance(sweep, SweepRecord)
        tracks.append(measure_pan(sweep, reference, optics.signs[0], optics.focal_x.value))
    yield StepMove(start, -up, config.fast_rad_s)
    return Calibration(optics, pan_gain, tilt_gain, fit_lag(tracks))


def _steps(
    joint: int, start: NDArray[np.float64], config: CalibrationConfig
) -> Iterator[StepMove]:
    """One joint up, down and up again in steps; it reaches every angle from both sides."""
    up, down = (0.5, 1.0), (0.5, 0.0, -0.5, -1.0)
    loop = [
        *((step, 1.0) for step in up),
        *((step, -1.0) for step in down),
        (-0.5, 1.0),
        (0.0, 1.0),
    ]
    for step, side in loop * config.loops:
        angles, sides = start.copy(), np.ones(2)
        angles[joint] += step * config.amplitude_rad
        sides[joint] = side
        yield StepMove(angles, sides, config.fast_rad_s)
