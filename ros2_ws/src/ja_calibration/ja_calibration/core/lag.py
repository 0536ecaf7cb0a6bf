"""Fit the delay of the images and the backlash from pan sweeps at two speeds.

At the speed v the camera lags the encoder by backlash / 2 + v * delay. One speed does not separate
the two, two speeds do. Only images from the middle of a swing count: there the gear has crossed
its backlash.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_calibration.core.fitted_value import FittedValue, jackknife
from ja_calibration.core.posed_image import PosedImage, TrackedPoints
from ja_common.core.stamps import NS_PER_S

LONGEST_DELAY_S = 0.2
_MIDDLE_SHARE = 0.45
_USED_SHARE = 0.8
_FEWEST = 3
_FEWEST_PASSAGES = 8
_ROUNDS = 3


@dataclass(frozen=True)
class SweepRecord:
    """The images of a sweep at one speed, and the encoder: stamps [ns] and pan [rad], (N,)."""

    images: Sequence[PosedImage]
    stamps_ns: Sequence[int]
    pan: Sequence[float]


@dataclass(frozen=True)
class Lag:
    """Delay of the image stamps behind those of the joint states [s], and pan backlash [rad].

    A positive delay: an image shows the posture that the joint states reported so much earlier
    than its stamp.
    """

    delay_s: FittedValue
    backlash: FittedValue


@dataclass(frozen=True)
class PanTrack:
    """Pan during a sweep, counted from the reference: by the encoder, and by the images.

    `joint_times_s` [s] and `joint` [rad], (N,), are the encoder's; `times_s` [s] and `shown`
    [rad], (M,), the images': NaN where an image shows none of the points.
    """

    joint_times_s: NDArray[np.float64]
    joint: NDArray[np.float64]
    times_s: NDArray[np.float64]
    shown: NDArray[np.float64]


def measure_pan(
    sweep: SweepRecord, reference: PosedImage, sign: float, focal_x: float
) -> PanTrack:
    """Measure how far the camera has panned since the reference in each image of a sweep."""
    points = TrackedPoints(reference.grey)
    zero_ns = sweep.stamps_ns[0]
    joint_times_s = (np.array(sweep.stamps_ns) - zero_ns) / NS_PER_S
    joint = sign * (np.array(sweep.pan) - reference.angles[0])
    times_s = np.array([(image.stamp_ns - zero_ns) / NS_PER_S for image in sweep.images])
    guesses = np.interp(times_s, joint_times_s, joint)
    # Images near the ends are not used.
    off_centre = np.abs(guesses - (joint.min() + joint.max()) / 2)
    used = off_centre < _USED_SHARE * np.ptp(joint) / 2
    shown = [
        _pan_in_image(points, focal_x, image, guess) if use else np.nan
        for image, guess, use in zip(sweep.images, guesses, used, strict=True)
    ]
    return PanTrack(joint_times_s, joint, times_s, np.array(shown))


def fit_lag(tracks: Sequence[PanTrack]) -> Lag:
    """Fit delay and backlash to sweeps at different speeds, by least squares.

    Raises ValueError when too few images show the middle of a swing, or when the delay is longer
    than `LONGEST_DELAY_S`.
    """
    delay_s = 0.0
    for _ in range(_ROUNDS):  # which images are from the middle depends on the delay
        passages = np.array([p for track in tracks for p in _passages(track, delay_s)])
        if len(passages) < _FEWEST_PASSAGES:
            raise ValueError(
                f'the images show the middle of only {len(passages)} swings: is the camera on, '
                'and is the amplitude large enough?'
            )
        delay_s = _fit_passages(passages)[0]
    if abs(delay_s) > LONGEST_DELAY_S:
        raise ValueError(f'images and joint states are more than {LONGEST_DELAY_S:g} s apart')
    groups = [np.array([index]) for index in range(len(passages))]
    return Lag(*jackknife(lambda chosen: _fit_passages(passages[chosen]), groups))


def _fit_passages(passages: NDArray[np.float64]) -> NDArray[np.float64]:
    """(delay [s], backlash [rad]) of passages (N, 2): speed [rad/s] and camera lag [rad]."""
    speed, lag = passages.T
    rows = np.column_stack([speed, np.sign(speed) / 2, np.ones(len(speed))])
    return np.linalg.lstsq(rows, lag, rcond=None)[0][:2]


def _passages(track: PanTrack, delay_s: float) -> Iterator[tuple[float, float]]:
    """Speed [rad/s] and lag [rad] of each passage through the middle.

    A line fitted to the encoder's angles removes its noise and its steps. (Interpolated noise
    would draw the delay to halfway between two joint states.)
    """
    low, high = track.joint.min(), track.joint.max()
    middle = np.abs(track.joint - (low + high) / 2) < _MIDDLE_SHARE * (high - low) / 2
    # Noise at the edge of the middle gives passages that are too short; they are dropped.
    edges = np.flatnonzero(np.diff(middle.astype(int), prepend=0, append=0))
    for begin, end in edges.reshape(-1, 2):
        times_s = track.joint_times_s[begin:end]
        during = (track.times_s - delay_s >= times_s[0]) & (track.times_s - delay_s <= times_s[-1])
        during &= np.isfinite(track.shown)
        if len(times_s) < _FEWEST or np.count_nonzero(during) < _FEWEST:
            continue
        zero_s = times_s.mean()
        speed, angle = np.polyfit(times_s - zero_s, track.joint[begin:end], 1)
        joint = angle + speed * (track.times_s[during] - zero_s)
        yield float(speed), float(np.mean(joint - track.shown[during]))


def _pan_in_image(
    points: TrackedPoints, focal_x: float, image: PosedImage, guess_rad: float
) -> float:
    """Pan of the camera since the image of the points [rad]; NaN if no point was found."""
    centre = (image.grey.shape[1] - 1) / 2
    found = points.find_in(image.grey, np.array([focal_x * np.tan(guess_rad), 0.0]))
    turned = np.arctan((found[:, 0] - centre) / focal_x) - np.arctan(
        (points.pixels[:, 0] - centre) / focal_x
    )
    known = np.isfinite(turned)
    return float(np.median(turned[known])) if known.any() else np.nan
