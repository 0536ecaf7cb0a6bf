"""The attention cycle: look at the caregiver, glance aside, shift, check for a fixation.

Call `step` once an image. The head glances only at views that the learner proposes. At every shift
the gate draws whether visual feedback (VF) or the learning module (LM) turns the head (Nagai et
al. 2003, section 2.2.5). A trial lasts from one look at the caregiver to the next.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import Configuration, parameter
from ja_common.core.posture import STILL_BELOW_RAD_S, Posture
from ja_common.core.stamps import NS_PER_S
from ja_control.core.gating import Gating


class Phase(Enum):
    """What the head does now."""

    LOOK = 'look'
    GLANCE = 'glance'
    SHIFT = 'shift'
    SEARCH = 'search'
    HOME = 'home'
    LOOK_AT = 'look_at'


class Source(Enum):
    """The module whose proposal moves the head."""

    NONE = 'none'
    FACE = 'face'
    GLANCE = 'glance'
    VISUAL_FEEDBACK = 'VF'
    LEARNING_MODULE = 'LM'


@dataclass(frozen=True)
class AttentionCycleConfig(Configuration):
    """Times and tolerances of the cycle."""

    dwell_s: float = parameter(
        0.2, 'time to stay on the centred face before the first shift', low=0.0, high=60.0
    )
    look_tolerance_rad: float = parameter(
        0.03, 'the face is centred when it is nearer to the centre than this', low=1e-3, high=0.5
    )
    still_below_rad_s: float = parameter(
        STILL_BELOW_RAD_S, 'a joint slower than this stands still', low=1e-4, high=5.0
    )
    arrived_within_rad: float = parameter(
        0.02, 'a shift has arrived when the head stands still this near to its target',
        low=1e-4, high=0.5,
    )  # fmt: skip
    settle_timeout_s: float = parameter(
        1.5, 'a shift that has not arrived by then ends where the head stands', low=0.05, high=60.0
    )
    max_glances: int = parameter(
        2, 'glances before the first shift, at views that the learner proposes', low=0, high=20
    )
    fixation_wait_s: float = parameter(
        0.0,
        'how long to wait, at rest after a shift, for a fixation; as long as the hold_s of the '
        'evaluator',
        low=0.0, high=10.0,
    )  # fmt: skip
    max_shifts: int = parameter(
        5, 'shifts after which a trial without fixation is given up', low=1, high=100
    )
    source_drawn: str = parameter(
        'every_shift', 'when the gate draws between VF and LM: at every shift, or once a trial',
        choices=('every_shift', 'first_shift'),
    )  # fmt: skip
    search_after_s: float = parameter(
        1.0, 'time without a face, looking where it was, before searching', low=0.0, high=60.0
    )
    search_period_s: float = parameter(8.0, 'period of the searching sweep', low=0.5, high=120.0)
    search_pan_rad: float = parameter(
        0.6, 'amplitude of the searching sweep in pan', low=0.0, high=3.0
    )
    search_tilt_rad: float = parameter(
        0.15, 'amplitude of the searching sweep in tilt', low=0.0, high=1.5
    )
    home_pan_rad: float = parameter(0.0, 'home posture: pan', low=-3.15, high=3.15)
    home_tilt_rad: float = parameter(0.0, 'home posture: tilt', low=-1.57, high=1.57)
    look_at_hold_s: float = parameter(
        2.0,
        'how long the head looks at a point of look_at, from its arrival on; each new point '
        'counts from zero',
        low=0.05, high=3600.0,
    )  # fmt: skip


@dataclass(frozen=True)
class CycleInput:
    """What the gate knows about one image: posture at its stamp, and proposals (2,) [rad] or None.

    `glance_delta`: to a view that the learner proposes before the shift. `fixation`: direction
    (2,) [rad] of the object in the centre, or None. `log_evidence` [nats]: that the learner does
    better than chance. `expected_gain`: how much better, as the learner believes, 0-1, or NaN.
    """

    posture: Posture
    face_delta: NDArray[np.float64] | None = None
    vf_delta: NDArray[np.float64] | None = None
    lm_delta: NDArray[np.float64] | None = None
    glance_delta: NDArray[np.float64] | None = None
    fixation: NDArray[np.float64] | None = None
    log_evidence: float = 0.0
    expected_gain: float = math.nan


@dataclass(frozen=True)
class Decision:
    """The decision on one image: the posture to take (2,) [rad], and why."""

    target: NDArray[np.float64]
    phase: Phase
    source: Source
    p_lm: float
    trials: int
    shifts: int


class AttentionCycle:
    """The state of the cycle; every random draw comes from `rng`.

    `reachable` returns the posture (2,) [rad] at which a motion towards a target ends: a shift to
    a target outside the limits has arrived where the limits end.
    """

    def __init__(
        self,
        config: AttentionCycleConfig,
        gating: Gating,
        rng: np.random.Generator,
        reachable: Callable[[NDArray[np.float64]], NDArray[np.float64]] = np.asarray,
    ) -> None:
        self.config = config
        self.gating = gating
        self._rng = rng
        self._reachable = reachable
        self.trials = 0
        self.unseen_s = 0.0
        """Time for which no face was there to look at, 0 while the head looks elsewhere."""
        self._unseen_since_ns: int | None = None
        self._caregiver: NDArray[np.float64] | None = None
        self._target: NDArray[np.float64] | None = None
        self._learner_drawn = False
        self._p_lm = gating.p_lm(0, 0.0)
        self._enter_phase(Phase.LOOK)

    def go_home(self) -> None:
        """End the trial, forget where the caregiver was, and turn home."""
        self._caregiver = None
        self._enter_phase(Phase.HOME)

    @property
    def is_interrupted(self) -> bool:
        """Return whether the head follows a request from outside, and no trial."""
        return self.phase in (Phase.HOME, Phase.LOOK_AT)

    def look_at(self, direction: NDArray[np.float64]) -> None:
        """End the trial, and look in a direction (2,) [rad] for `look_at_hold_s`."""
        self._enter_phase(Phase.LOOK_AT)
        self._target = direction

    def end_look_at(self) -> bool:
        """Look at the caregiver again; return whether the head looked at a point."""
        if self.phase is not Phase.LOOK_AT:
            return False
        self._target = None
        self._enter_phase(Phase.LOOK)
        return True

    def restart(self) -> None:
        """End the trial (after a hold or a jump of the clock) and look at the caregiver again.

        A turn to the home posture goes on.
        """
        self._target = None
        self._enter_phase(Phase.HOME if self.phase is Phase.HOME else Phase.LOOK)

    def step(self, percept: CycleInput) -> Decision:
        """Advance the cycle by one image, and return which posture to take."""
        step = {
            Phase.LOOK: self._step_look,
            Phase.GLANCE: self._step_glance,
            Phase.SHIFT: self._step_shift,
            Phase.SEARCH: self._step_search,
            Phase.HOME: self._step_home,
            Phase.LOOK_AT: self._step_look_at,
        }[self.phase]
        self._p_lm = self.gating.p_lm(self.trials, percept.log_evidence, percept.expected_gain)
        step(percept)
        self._record_unseen(percept)
        target = percept.posture.position if self._target is None else self._target
        return Decision(target, self.phase, self._source, self._p_lm, self.trials, self._shifts)

    def _enter_phase(self, phase: Phase) -> None:
        self.phase = phase
        self._source = Source.NONE
        self._shifts = self._glances = 0
        self._since_ns: int | None = None
        self._rests_since_ns: int | None = None
        self._face_in_view = True
        # Where the head stood with the face in the centre, and where it began to search.
        self._looked_from: NDArray[np.float64] | None = None
        self._search_from: NDArray[np.float64] | None = None

    def _record_unseen(self, percept: CycleInput) -> None:
        now_ns = percept.posture.stamp_ns
        if percept.face_delta is not None or self.phase not in (Phase.LOOK, Phase.SEARCH):
            self._unseen_since_ns = None
        elif self._unseen_since_ns is None or now_ns < self._unseen_since_ns:
            self._unseen_since_ns = now_ns
        since_ns = now_ns if self._unseen_since_ns is None else self._unseen_since_ns
        self.unseen_s = (now_ns - since_ns) / NS_PER_S

    def _elapsed_s(self, percept: CycleInput) -> float:
        if self._since_ns is None:
            self._since_ns = percept.posture.stamp_ns
        return (percept.posture.stamp_ns - self._since_ns) / NS_PER_S

    def _step_look(self, percept: CycleInput) -> None:
        face = percept.face_delta
        if self._face_in_view is not (face is not None):
            # Dwelling on the face and missing it are two waits; each starts from zero.
            self._face_in_view = face is not None
            self._since_ns = None
        if face is None:
            self._look_at_last_face(percept)
            return
        self._source = Source.FACE
        self._caregiver = percept.posture.position + face
        centred = math.hypot(*face) <= self.config.look_tolerance_rad
        if not (centred and self._is_still(percept)):
            self._target = self._caregiver
            self._since_ns = None
            return
        # Centred: hold still, so that only the caregiver moves in the image of the face.
        self._looked_from = percept.posture.position
        if self._elapsed_s(percept) >= self.config.dwell_s:
            self._enter_phase(Phase.GLANCE)
            self._glance_or_shift(percept)

    def _step_glance(self, percept: CycleInput) -> None:
        if self._has_arrived(percept):
            self._glance_or_shift(percept)

    def _glance_or_shift(self, percept: CycleInput) -> None:
        """Turn to the next proposed view, or start the first shift."""
        if percept.glance_delta is None or self._glances >= self.config.max_glances:
            self._enter_phase(Phase.SHIFT)
            self._start_shift(percept)
            return
        self._glances += 1
        self._source = Source.GLANCE
        self._turn_by(percept, percept.glance_delta)

    def _look_at_last_face(self, percept: CycleInput) -> None:
        self._source = Source.NONE
        if self._looked_from is not None:
            # An interrupted look is no trial: a rest elsewhere would look like its shift.
            self._target = self._looked_from
        elif self._caregiver is not None:
            self._target = self._caregiver
        if self._elapsed_s(percept) >= self.config.search_after_s and self._is_still(percept):
            self._caregiver = None
            self._enter_phase(Phase.SEARCH)

    def _step_shift(self, percept: CycleInput) -> None:
        if not self._has_arrived(percept):
            return
        if percept.fixation is None and self._rested_s(percept) < self.config.fixation_wait_s:
            return
        self._shifts += 1
        if percept.fixation is None and self._shifts < self.config.max_shifts:
            self._start_shift(percept)
            return
        self.trials += 1
        self._enter_phase(Phase.LOOK)
        if self._caregiver is not None:
            self._target = self._caregiver

    def _start_shift(self, percept: CycleInput) -> None:
        # Drawn even when the learner has no answer: the same seed gives the same sequence of
        # sources.
        if self._shifts == 0 or self.config.source_drawn == 'every_shift':
            self._learner_drawn = bool(self._rng.random() < self._p_lm)
        delta = percept.lm_delta if self._learner_drawn else None
        self._source = Source.LEARNING_MODULE
        if delta is None:
            self._source, delta = Source.VISUAL_FEEDBACK, percept.vf_delta
        self._turn_by(percept, np.zeros(2) if delta is None else delta)

    def _turn_by(self, percept: CycleInput, delta: NDArray[np.float64]) -> None:
        self._target = percept.posture.position + delta
        self._since_ns = percept.posture.stamp_ns
        self._rests_since_ns = None

    def _rested_s(self, percept: CycleInput) -> float:
        """Time [s] since the head arrived at the target of the shift."""
        if self._rests_since_ns is None:
            self._rests_since_ns = percept.posture.stamp_ns
        return (percept.posture.stamp_ns - self._rests_since_ns) / NS_PER_S

    def _step_search(self, percept: CycleInput) -> None:
        if percept.face_delta is not None:
            self._enter_phase(Phase.LOOK)
            self._step_look(percept)
            return
        c, home = self.config, self._home_posture()
        if self._search_from is None:
            self._search_from = percept.posture.position
        # To the home posture at the speed of the sweep, and on in the same direction. One of the
        # joints always turns: a rest would look like the shift of an interrupted look.
        rate = 2 * math.pi / c.search_period_s
        way = home - self._search_from
        joining_s = math.hypot(*way) / max(rate * c.search_pan_rad, 1e-3)
        elapsed_s = self._elapsed_s(percept)
        if elapsed_s < joining_s:
            self._target = self._search_from + elapsed_s / joining_s * way
            return
        angle = math.copysign(rate, way[0]) * (elapsed_s - joining_s)
        sweep = [c.search_pan_rad * math.sin(angle), c.search_tilt_rad * math.sin(2 * angle)]
        self._target = home + sweep

    def _step_home(self, percept: CycleInput) -> None:
        self._target = self._home_posture()
        if self._has_arrived(percept):
            self._enter_phase(Phase.LOOK)

    def _step_look_at(self, percept: CycleInput) -> None:
        if self._elapsed_s(percept) >= self.config.look_at_hold_s:
            self._enter_phase(Phase.LOOK)

    def _home_posture(self) -> NDArray[np.float64]:
        return np.array([self.config.home_pan_rad, self.config.home_tilt_rad])

    def _is_still(self, percept: CycleInput) -> bool:
        return percept.posture.is_still(self.config.still_below_rad_s)

    def _has_arrived(self, percept: CycleInput) -> bool:
        if self._elapsed_s(percept) >= self.config.settle_timeout_s:
            return True
        return (
            self._target is not None
            and percept.posture.stamp_ns != self._since_ns
            and self._is_still(percept)
            and _within(
                percept.posture.position,
                self._reachable(self._target),
                self.config.arrived_within_rad,
            )
        )


def _within(a: ArrayLike, b: ArrayLike, tolerance: float) -> bool:
    return bool(np.all(np.abs(np.subtract(a, b)) < tolerance))
