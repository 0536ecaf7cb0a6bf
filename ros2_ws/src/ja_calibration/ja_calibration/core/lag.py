"""How late the pictures are, from a head that goes to and fro at two speeds.

On its way at the speed v the camera lags the encoder by backlash / 2 + v * delay. One speed does
not tell the two apart, two do. So only pictures from the middle of a swing count, where the play
has long been taken up.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_calibration.core.figure import Figure, jackknife
from ja_calibration.core.views import Points, View
from ja_common.core.stamps import NS_PER_S

LONGEST_DELAY_S = 0.2
_MIDDLE_SHARE = 0.45
_USED_SHARE = 0.8
_FEWEST = 3
_FEWEST_PASSAGES = 8
_ROUNDS = 3


@dataclass(frozen=True)
class Swayed:
    """The views of a sway at one speed, and the encoder: stamps [ns] and pan [rad], (N,)."""

    views: Sequence[View]
    stamps_ns: Sequence[int]
    pan: Sequence[float]


@dataclass(frozen=True)
class Lag:
    """By how much stamps of pictures are later than those of joint states [s]; the play [rad].

    Positive: a picture shows what the joint states said that much earlier than its stamp.
    """

    delay_s: Figure
    backlash: Figure


@dataclass(frozen=True)
class Track:
    """What is known of a sway: encoder (N,) [s], [rad]; pictures (M,) [s], [rad], NaN: nothing.

    Angles of both count from the reference.
    """

    joint_times_s: NDArray[np.float64]
    joint: NDArray[np.float64]
    times_s: NDArray[np.float64]
    shown: NDArray[np.float64]


def track_of(swayed: Swayed, reference: View, sign: float, focal_x: float) -> Track:
    """Measure how far the camera has panned since the reference in each view of a sway."""
    points = Points(reference.grey)
    zero_ns = swayed.stamps_ns[0]
    joint_times_s = (np.array(swayed.stamps_ns) - zero_ns) / NS_PER_S
    joint = sign * (np.array(swayed.pan) - reference.angles[0])
    times_s = np.array([(view.stamp_ns - zero_ns) / NS_PER_S for view in swayed.views])
    guesses = np.interp(times_s, joint_times_s, joint)
    # Those near the ends are of no use.
    off_centre = np.abs(guesses - (joint.min() + joint.max()) / 2)
    used = off_centre < _USED_SHARE * np.ptp(joint) / 2
    shown = [
        _picture_angle(points, focal_x, view, guess) if use else np.nan
        for view, guess, use in zip(swayed.views, guesses, used, strict=True)
    ]
    return Track(joint_times_s, joint, times_s, np.array(shown))


def fit_lag(tracks: Sequence[Track]) -> Lag:
    """Delay and play that explain sways at different speeds best.

    Raises ValueError when too few pictures show the head on its way, or when pictures and joint
    states are farther apart than can be told.
    """
    delay_s = 0.0
    for _ in range(_ROUNDS):  # which pictures are from the middle depends on the delay
        passages = np.array([p for track in tracks for p in _passages(track, delay_s)])
        if len(passages) < _FEWEST_PASSAGES:
            raise ValueError(
                f'only {len(passages)} swings were seen on their way: is the camera on, and is '
                'the amplitude large enough?'
            )
        delay_s = _explain(passages)[0]
    if abs(delay_s) > LONGEST_DELAY_S:
        raise ValueError(f'pictures and joint states are more than {LONGEST_DELAY_S:g} s apart')
    groups = [np.array([index]) for index in range(len(passages))]
    return Lag(*jackknife(lambda chosen: _explain(passages[chosen]), groups))


def _explain(passages: NDArray[np.float64]) -> NDArray[np.float64]:
    """(delay, backlash) of passages: each its speed, and by how much the camera lags, (N, 2)."""
    speed, lag = passages.T
    rows = np.column_stack([speed, np.sign(speed) / 2, np.ones(len(speed))])
    return np.linalg.lstsq(rows, lag, rcond=None)[0][:2]


def _passages(track: Track, delay_s: float) -> Iterator[tuple[float, float]]:
    """Speed [rad/s] and lag [rad] of each passage through the middle.

    A line through what the encoder said meanwhile takes its noise and its steps out. (Noise that
    is interpolated instead draws the delay to halfway between two joint states.)
    """
    low, high = track.joint.min(), track.joint.max()
    middle = np.abs(track.joint - (low + high) / 2) < _MIDDLE_SHARE * (high - low) / 2
    # Noise at the border of the middle makes crumbs, which are too short.
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


def _picture_angle(points: Points, focal_x: float, view: View, guess_rad: float) -> float:
    """How far the camera has panned since the points' picture [rad]; NaN if nothing was found."""
    centre = (view.grey.shape[1] - 1) / 2
    seen = points.find_in(view.grey, np.array([focal_x * np.tan(guess_rad), 0.0]))
    turned = np.arctan((seen[:, 0] - centre) / focal_x) - np.arctan(
        (points.pixels[:, 0] - centre) / focal_x
    )
    known = np.isfinite(turned)
    return float(np.median(turned[known])) if known.any() else np.nan
