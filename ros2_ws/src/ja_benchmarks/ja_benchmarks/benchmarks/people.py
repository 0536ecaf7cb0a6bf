"""Several people before the head: does it keep to the caregiver, and is what it learns hers?

A wide film of people who lean, leave, come back and pass by (`people_film`) is shown to the
digital head. Detector, gate and trial pipeline close the loop, as on a rig with a webcam. The
film's own record of who is where serves the score alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_benchmarks.people_film import (
    Camera,
    Path,
    PeopleFilm,
    Place,
    Thing,
    draw_people,
)
from ja_benchmarks.rows import Row
from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import caregiver_face
from ja_common.core.geometry import directions_of_rays
from ja_common.core.statistics import wilson_interval
from ja_control.core.attention_cycle import AttentionCycleConfig, Phase
from ja_experiments.agents.robot import FixedTurn, Robot
from ja_experiments.config import ExperimentConfig
from ja_learning.core.trial import Trial
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import SalientFeatureDetector
from ja_sim.core.digital_head import DigitalHead, DigitalHeadConfig

SEEDS = range(3)
QUICK_SEEDS = range(1)
_WIDE = DigitalHeadConfig(wide_view_rad=math.radians(60), speed_rad_s=2.0, time_constant_s=0.05)
# A look within so many face widths of a face is at that face.
_AT_FACE_WIDTHS = 0.6
GONE_FOR_GOOD_S = 10.0
"""A caregiver who is away for longer may have a successor."""
_TURNS_RAD = (0.0, 0.5, -0.4, 0.6, -0.6, 0.3, -0.2)


@dataclass(frozen=True)
class Scenario:
    """A film in words: the people's paths, the caregiver's first, the things and the camera."""

    paths: Sequence[Path]
    seconds: float = 20.0
    things: Sequence[Thing] = ()
    camera: Camera = field(default_factory=Camera)


@dataclass
class PeopleScore:
    """What one film gave.

    ``hers``, ``others``: images with a caregiver's face in the detections that is hers, or
    another's. ``invented``: that is no person's. ``taken``: times that another face took hers'
    place. ``found_s``: time from each return until her face is reported again. ``false_trials``
    of ``trials``: begun with another face, or never shifted. ``adopted_s``: time after she left
    until another face was taken for the caregiver's; NaN if never.
    """

    hers: int = 0
    others: int = 0
    invented: int = 0
    taken: int = 0
    found_s: list[float] = field(default_factory=list)
    trials: int = 0
    false_trials: int = 0
    adopted_s: float = math.nan


class _TrialCounter(FixedTurn):
    """A learner that only keeps what it is to learn from."""

    def __init__(self) -> None:
        super().__init__((0.0, 0.0))
        self.trials: list[Trial] = []

    def update(self, trial: Trial) -> None:
        self.trials.append(trial)


def run(quick: bool = False) -> dict[str, Row]:
    """Show every film with people of several seeds; return the table."""
    cv2.setNumThreads(1)
    seeds = QUICK_SEEDS if quick else SEEDS
    rows: dict[str, Row] = {}
    for name, scenario in SCENARIOS.items():
        rows |= table(name, [watch(scenario, seed) for seed in seeds])
    return rows


def table(name: str, scores: Sequence[PeopleScore]) -> dict[str, Row]:
    """Return the rows of one scenario."""
    hers = sum(score.hers for score in scores)
    seen = hers + sum(score.others + score.invented for score in scores)
    rows = {
        f'{name}: reported face is hers': _row(hers / max(seen, 1), 'share of images', seen),
        f'{name}: taken for her': _row(sum(s.taken for s in scores), 'times', len(scores)),
    }
    found = [seconds for score in scores for seconds in score.found_s]
    if found:
        rows[f'{name}: found again after'] = _row(float(np.mean(found)), 's', len(found))
    adopted = [score.adopted_s for score in scores if math.isfinite(score.adopted_s)]
    if adopted:
        rows[f'{name}: another is the caregiver after'] = _row(
            float(np.mean(adopted)), 's', len(adopted)
        )
    trials = sum(score.trials for score in scores)
    false = sum(score.false_trials for score in scores)
    interval = wilson_interval(false, trials) if trials else None
    rows[f'{name}: false trials'] = {
        'value': float(false), 'unit': 'trials', 'n': trials,
        'interval': None if interval is None else [trials * share for share in interval],
    }  # fmt: skip
    return rows


def _row(value: float, unit: str, count: int) -> Row:
    return {'value': float(value), 'unit': unit, 'n': count, 'interval': None}


def watch(scenario: Scenario, seed: int) -> PeopleScore:
    """Show a film to the head; return the score."""
    people = draw_people(len(scenario.paths), np.random.default_rng(seed))
    film = PeopleFilm(
        list(zip(people, scenario.paths, strict=True)), scenario.seconds, scenario.things,
        scenario.camera, seed,
    )  # fmt: skip
    head, detector = DigitalHead(_WIDE), SalientFeatureDetector(BlazeFace())
    camera = CameraModel.from_field_of_view(320, 240, math.radians(36))
    counter = _TrialCounter()
    robot = Robot(_config(), counter, np.random.default_rng(seed))
    judge = _Judge()
    for frame in film.frames():
        view, posture = head.render_view(frame.picture, frame.stamp_ns)
        percept = detector.detect(view, posture.stamp_ns, camera, posture)
        seen = caregiver_face(percept.detections)
        face = None if seen is None else directions_of_rays(posture.position, seen.ray)
        step = robot.step(percept.detections, percept.face_image, posture)
        judge.judge_image(frame.places, frame.hidden, face, frame.stamp_ns)
        if percept.face_image is not None:
            judge.judge_look(frame.places, face)
        judge.judge_phase(step.decision.phase)
        for _ in counter.trials:
            judge.judge_trial()
        counter.trials.clear()
        head.command(step.command)
    return judge.score


def _config() -> ExperimentConfig:
    cycle = AttentionCycleConfig(fixation_wait_s=0.1)
    return ExperimentConfig(cycle=cycle).with_settings(
        {'gating': 'constant', 'p_lm_max': 0.0, 'hold_s': 0.1}
    )


class _Judge:
    """Compares what the head does with who is where.

    With two people at the start, either may be chosen: the first one chosen is the caregiver.
    """

    def __init__(self) -> None:
        self.score = PeopleScore()
        self._hers: int | None = None
        self._left_ns: int | None = None
        self._back_ns: int | None = None
        self._last: int | None = None
        self._look_is_hers = False
        self._shifted = False

    def judge_image(
        self,
        places: list[Place | None],
        hidden: bool,
        face: NDArray[np.float64] | None,
        now_ns: int,
    ) -> None:
        """Judge the face that one image reports as the caregiver's, (2,) [rad] or None."""
        who = None if face is None else _nearest(places, face, self._hers)
        if self._hers is None and who is not None:
            self._hers = who
        hers = self._hers or 0
        if places[hers] is None:
            self._left_ns, self._back_ns = self._left_ns or now_ns, None
        elif self._left_ns is not None:
            self._left_ns, self._back_ns = None, now_ns
        if face is None:
            return
        if who is None:
            self.score.invented += 1
        elif who == hers:
            self.score.hers += 1
            if self._back_ns is not None:
                self.score.found_s.append((now_ns - self._back_ns) * 1e-9)
                self._back_ns = None
        else:
            self._judge_other(who, now_ns)
        self._last = who

    def _judge_other(self, who: int, now_ns: int) -> None:
        gone_s = 0.0 if self._left_ns is None else (now_ns - self._left_ns) * 1e-9
        if gone_s and math.isnan(self.score.adopted_s):
            self.score.adopted_s = gone_s
        if gone_s > GONE_FOR_GOOD_S:
            self._hers = who
            return
        self.score.others += 1
        self.score.taken += self._last != who

    def judge_look(self, places: list[Place | None], face: NDArray[np.float64] | None) -> None:
        """Note at whose face the head looks, now that a picture of it is taken."""
        who = None if face is None else _nearest(places, face, self._hers)
        self._look_is_hers, self._shifted = who is not None and who == self._hers, False

    def judge_phase(self, phase: Phase) -> None:
        """Note whether the head has turned away of its own."""
        self._shifted |= phase in (Phase.SHIFT, Phase.GLANCE)

    def judge_trial(self) -> None:
        """Judge a trial that is handed to the learner now."""
        self.score.trials += 1
        self.score.false_trials += not (self._look_is_hers and self._shifted)


def _nearest(
    places: list[Place | None], face: NDArray[np.float64], preferred: int | None
) -> int | None:
    """Return the person whose face is there, one before others; None where no person's is."""
    far = [
        math.inf if place is None else float(np.hypot(*(place.direction - face))) / place.width_rad
        for place in places
    ]
    best = int(np.argmin(far))
    if preferred is not None and far[preferred] < _AT_FACE_WIDTHS:
        return preferred
    return best if far[best] < _AT_FACE_WIDTHS else None


def _turning(time_s: float) -> float:
    """Return how far she has turned her head: to another thing every two seconds."""
    index, share = int(time_s / 2.0), min(1.0, (time_s % 2.0) / 0.3)
    before, now = _TURNS_RAD[index % len(_TURNS_RAD) - 1], _TURNS_RAD[index % len(_TURNS_RAD)]
    return before + share * (now - before)


def _sits(pan: float = 0.05, tilt: float = 0.0, distance_m: float = 1.2) -> Path:
    return lambda t: Place(pan, tilt, distance_m, _turning(t))


def _leans(t: float) -> Place:
    distance = 1.2 - 0.35 * math.sin(2 * math.pi * t / 7.0)
    side = 0.15 * math.sin(2 * math.pi * t / 4.0)
    return Place(math.atan2(side, distance), 0.04 * math.sin(1.1 * t), distance, _turning(t))


def _leaves(t_leave: float, t_back: float, pan: float = 0.05, back_at: float = -0.2) -> Path:
    """Return the path of one who walks out to the left, and back in from the right."""

    def path(t: float) -> Place | None:
        if t < t_leave:
            return Place(pan, 0.0, 1.2, _turning(t))
        if t < t_back:
            at = pan + 0.7 * (t - t_leave)
            return Place(at, -0.03, 1.2, 0.6) if at < 0.7 else None
        at = max(-0.7, -0.7 + 0.7 * (t - t_back))
        return Place(min(at, back_at), 0.0, 1.2, -0.5 if at < back_at else _turning(t))

    return path


def _crosses(
    times: Sequence[float], distance_m: float, speed_m_s: float, tilt: float = 0.0
) -> Path:
    """Return the path of one who crosses the whole view at these times, to and fro."""
    speed = speed_m_s / distance_m

    def path(t: float) -> Place | None:
        for number, start in enumerate(times):
            along = speed * (t - start) - 0.75
            if -0.75 <= along <= 0.75:
                side = 1 if number % 2 else -1
                return Place(side * along, tilt, distance_m, -0.7 * side)
        return None

    return path


def _visits(t_in: float, t_out: float, pan: float, distance_m: float, side: int = -1) -> Path:
    """Return the path of one who comes in from a side, stays at ``pan``, and leaves again."""

    def path(t: float) -> Place | None:
        away = max(0.0, t_in - t, t - t_out) * 0.8
        at = pan + side * away
        yaw = 0.0 if away == 0.0 else -0.6 * side
        return Place(at, -0.03, distance_m, yaw) if t_in - 1.5 < t and abs(at) < 0.75 else None

    return path


def _swaps(pan: float, to: float, t_swap: float, distance_m: float) -> Path:
    def path(t: float) -> Place:
        share = min(1.0, max(0.0, (t - t_swap) / 2.0))
        yaw = _turning(t) if share in (0.0, 1.0) else math.copysign(0.5, to - pan)
        return Place(pan + share * (to - pan), 0.0, distance_m, yaw)

    return path


def _lies(pan: float, tilt: float) -> Callable[[float], tuple[float, float, bool]]:
    return lambda _: (pan, tilt, False)


def _carried(t: float) -> tuple[float, float, bool]:
    held = (t % 5.0) < 3.0
    at = 0.3 * math.sin(2 * math.pi * (t % 5.0) / 3.0) if held else 0.0
    return -0.05 + at, 0.16 - 0.06 * abs(at), held


_THINGS = (
    Thing((220, 40, 40), _lies(0.3, 0.13)),
    Thing((40, 180, 60), _lies(-0.32, 0.12)),
    Thing((50, 80, 220), _lies(-0.15, 0.17)),
)
_WEBCAM = Camera(
    exposure=lambda t: 1.0 + 0.3 * math.sin(0.9 * t) - 0.2 * (t % 6.0 > 4.0),
    shake=lambda t: (7.0 * math.sin(7.0 * t), 4.0 * math.sin(5.0 * t), 0.04 * math.sin(1.3 * t)),
    jpeg_quality=15,
    noise=4.0,
)
_BEHIND = _crosses((5.0, 12.0), 2.0, 1.0)
_BEFORE = _crosses((5.0, 12.0), 0.75, 0.9)

SCENARIOS: dict[str, Scenario] = {
    'sits alone': Scenario([_sits()], things=_THINGS),
    'leans': Scenario([_leans], things=_THINGS),
    'leaves for 5 s': Scenario([_leaves(6.0, 11.0)], things=_THINGS),
    'one passes behind': Scenario([_sits(), _BEHIND], things=_THINGS),
    'one passes before': Scenario([_sits(), _BEFORE], things=_THINGS),
    'one stands beside': Scenario([_sits(), _visits(6.0, 15.0, -0.2, 1.0)], things=_THINGS),
    'two at the start': Scenario(
        [_swaps(0.18, -0.15, 8.0, 1.25), _swaps(-0.18, 0.15, 8.0, 1.2)], things=_THINGS
    ),
    'leaves, one takes the seat': Scenario(
        [_leaves(6.0, 12.0), _visits(8.5, 14.0, 0.05, 1.2)], things=_THINGS
    ),
    'leaves for good, one stays': Scenario(
        [_leaves(5.0, 99.0), _visits(8.0, 99.0, 0.05, 1.2)], 28.0, things=_THINGS
    ),
    'hands move things': Scenario([_sits()], things=(*_THINGS, Thing((230, 200, 40), _carried))),
    'poor webcam, one passes behind': Scenario([_leans, _BEHIND], things=_THINGS, camera=_WEBCAM),
}
