"""What the head does while it is calibrated, as orders to whoever moves it.

A generator: it gives an order, and is sent what was seen on the way.
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_calibration.core.figure import Figure
from ja_calibration.core.lag import Lag, Swayed, fit_lag, track_of
from ja_calibration.core.optics import Optics, fit_gain, fit_optics
from ja_calibration.core.views import View
from ja_common.core.config import parameter


@dataclass(frozen=True)
class CourseConfig:
    """How far and how fast the head moves, about where it stands when it begins."""

    amplitude_rad: float = parameter(
        0.1, 'largest angle from the start, in pan and in tilt', low=0.03, high=0.3
    )
    loops: int = parameter(2, 'how often each joint goes up and down in steps', low=1, high=20)
    slow_rad_s: float = parameter(
        0.08, 'speed of the slow swings, by which the play is told', low=0.01, high=1.0
    )
    fast_rad_s: float = parameter(
        0.35, 'speed of the quick swings, by which the delay is told, and of steps',
        low=0.02, high=2.0,
    )  # fmt: skip
    slow_swings: int = parameter(4, 'slow swings, of one way each', low=2, high=100)
    fast_swings: int = parameter(16, 'quick swings, of one way each', low=2, high=100)


@dataclass(frozen=True)
class Rest:
    """Go to these angles (2,) [rad] and stand; to be answered with a `View` of several pictures.

    `side` (2,): from which side each joint comes, +1 from below, -1 from above.
    """

    angles: NDArray[np.float64]
    side: NDArray[np.float64]
    speed_rad_s: float


@dataclass(frozen=True)
class Sway:
    """Pan so many times from one side of these angles to the other; answered with `Swayed`."""

    angles: NDArray[np.float64]
    amplitude_rad: float
    swings: int
    speed_rad_s: float


@dataclass(frozen=True)
class Calibration:
    """All that was found; the gains are those of commands: how far a joint goes for a radian."""

    optics: Optics
    pan_gain: Figure
    tilt_gain: Figure
    lag: Lag


Course = Generator[Rest | Sway, View | Swayed, Calibration]


def course(config: CourseConfig, start: ArrayLike) -> Course:
    """Calibrate about a start (2,) [rad]. Raises ValueError when the picture does not allow it."""
    start = np.asarray(start, float)
    reach = config.amplitude_rad
    up = np.ones(2)
    # From below, in both joints: the play then lies on a known side.
    yield Rest(start - reach / 2, -up, config.fast_rad_s)
    reference = yield Rest(start, up, config.fast_rad_s)
    assert isinstance(reference, View)
    orders = [order for joint in (0, 1) for order in _steps(joint, start, config)]
    views = []
    for order in orders:
        view = yield order
        assert isinstance(view, View)
        views.append(view)
    optics = fit_optics(reference, views, [order.side for order in orders])
    told = np.array([order.angles for order in orders])
    done = np.array([view.angles for view in views])
    pan_gain, tilt_gain = (fit_gain(told[:, joint], done[:, joint]) for joint in (0, 1))
    tracks = []
    for swings, speed in (
        (config.slow_swings, config.slow_rad_s),
        (config.fast_swings, config.fast_rad_s),
    ):
        swayed = yield Sway(start, reach, swings, speed)
        assert isinstance(swayed, Swayed)
        tracks.append(track_of(swayed, reference, optics.signs[0], optics.focal_x.value))
    yield Rest(start, -up, config.fast_rad_s)
    return Calibration(optics, pan_gain, tilt_gain, fit_lag(tracks))


def _steps(joint: int, start: NDArray[np.float64], config: CourseConfig) -> Iterator[Rest]:
    """One joint up, down and up again in steps; every angle is come to from both sides."""
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
        yield Rest(angles, sides, config.fast_rad_s)
