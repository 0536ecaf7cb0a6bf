"""The state of the live page, from the messages of the graph: no ROS and no web here."""

import math
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ja_common.core.detection import Detection
from ja_common.core.health import Level
from ja_common.core.learning_curve import LearningCurve
from ja_common.core.weight_files import weight_files_text

WINDOW_TRIALS = 100
STOPPED_AFTER_S = 2.0
"""The graph counts as stopped after this time without a new image [s]."""
_SILENT_AFTER_S = 3.0  # every node reports its health at 1 Hz
_LOG_LINES = 200
# What foreign nodes publish must not fill the memory, nor the page, which is sent four times a
# second.
_MOST_NODES = 100
_MOST_VALUES = 40
_LONGEST_TEXT = 300
_LONGEST_LINE = 4000
_SOURCES = ('face', 'glance', 'VF', 'LM')
_INTERRUPTIONS = ('home', 'look_at')
_CURVE_POINTS = 200
_ACTIVITIES = {
    ('look', ''): 'turning back to where the caregiver was',
    ('look', 'face'): 'looking at the caregiver',
    ('shift', 'VF'): 'turning to the most salient object (visual feedback)',
    ('shift', 'LM'): 'turning to the predicted gaze target (learning module)',
    ('search', ''): 'searching for the caregiver',
    ('home', ''): 'turning home',
    ('look_at', ''): 'looking at a point, as another node asks (look_at)',
}
"""Texts by the phase and the source in the status of the gate."""
_CURVE_EVERY_S = 1.0


class RunState(Enum):
    """What the graph as a whole is doing."""

    WAITING = 'waiting'
    RUNNING = 'running'
    PAUSED = 'paused'
    HELD = 'head held'
    STOPPED = 'stopped'


@dataclass(frozen=True)
class State:
    """What the graph is doing, and why in one sentence."""

    run: RunState
    text: str

    @property
    def is_live(self) -> bool:
        """Return whether the picture is current."""
        return self.run in (RunState.RUNNING, RunState.HELD)


@dataclass(frozen=True)
class NodeHealth:
    """Health of one node as last reported; `values` are its figures."""

    node: str
    level: Level
    message: str
    reported_s: float
    values: Mapping[str, str]

    def at(self, now_s: float) -> 'NodeHealth':
        """Return the health at a time: STALE when the node is silent."""
        silent_s = now_s - self.reported_s
        if silent_s < _SILENT_AFTER_S:
            return self
        return NodeHealth(
            self.node, Level.STALE, f'silent for {silent_s:.0f} s', self.reported_s, self.values
        )


@dataclass(frozen=True)
class TruthView:
    """Where the objects of the sim are, (n, 3) [m] and (n, 2) [rad]; index of the attended one."""

    positions: NDArray[np.float64]
    directions: NDArray[np.float64]
    attended: int


@dataclass(frozen=True)
class SceneView:
    """Detections, posture and belief at one image; postures and directions are (pan, tilt) [rad].

    `half_view` is half the field of view [rad], sideways and upward; `low` and `high` are the
    limits of the joints, `detections` stand at `directions` (n, 2). `belief` (m, 3) holds samples
    of the learner's belief: direction and weight. `truth` is set on request, in simulation.
    `gaze`: where the attended face looks, yaw and pitch (2,) [rad] as in `FaceGaze`, if read.
    """

    half_view: tuple[float, float]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    posture: NDArray[np.float64] | None = None
    command: NDArray[np.float64] | None = None
    detections: Sequence[Detection] = ()
    directions: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    belief: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    truth: TruthView | None = None
    gaze: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class CurvePoints:
    """Success over trials as five equally long lists: a rate, its 95 % interval, and p(LM)."""

    trials: list[int] = field(default_factory=list)
    rate: list[float] = field(default_factory=list)
    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)
    p_lm: list[float] = field(default_factory=list)

    @classmethod
    def of(cls, curve: LearningCurve) -> 'CurvePoints':
        """Thin a curve to the points that a screen can show; the last trial is one of them."""
        count = len(curve.records)
        chosen = np.arange(count)[:: -max(1, -(-count // _CURVE_POINTS))][::-1]
        rates = curve.recent_rates(WINDOW_TRIALS)[chosen]
        low, high = _wilson(rates, np.minimum(chosen + 1, WINDOW_TRIALS))
        p_lm = np.array([curve.records[i].p_lm for i in chosen])
        return cls(
            (chosen + 1).tolist(),
            *(np.round(values, 4).tolist() for values in (rates, low, high, p_lm)),
        )


class ViewModel:
    """Trials, health of the nodes, log and state of the graph; times in seconds, monotonic."""

    def __init__(self, now_s: float) -> None:
        self.curve = LearningCurve()
        self.gate: Mapping[str, str] = {}
        self.fixations: Counter[str] = Counter()
        self.track = ''
        self.weight_files: Mapping[str, str] = {}
        self.log: deque[tuple[int, str]] = deque(maxlen=_LOG_LINES)
        self.log_lines = 0
        self._node_health: dict[str, NodeHealth] = {}
        self._start_s = now_s
        self._stamp_ns: int | None = None
        self._new_image_s = now_s
        self._any_image_s = now_s
        self._fixated = False
        self._points = CurvePoints()
        self._drawn_s = -math.inf

    def reset_silence(self, now_s: float) -> None:
        """Count silence from now on: a viewer has come."""
        self._new_image_s = now_s

    def record_image(self, stamp_ns: int, now_s: float) -> None:
        """Record an image; the same stamp again is no new image."""
        self._any_image_s = now_s
        if stamp_ns != self._stamp_ns:
            self._stamp_ns, self._new_image_s = stamp_ns, now_s

    def record_fixation(self) -> None:
        """Record a fixation; it counts for the source of the last shift in the gate's status."""
        self._fixated = True

    def record_gate_status(self, values: Mapping[str, str]) -> None:
        """Record the values of the gate's status; a trial ends when the phase of shifts does."""
        phase = values.get('phase')
        if self.gate.get('phase') == 'shift' and phase != 'shift':
            if phase not in _INTERRUPTIONS:
                source = self.gate.get('source') if self._fixated else 'none'
                self.fixations[source if source in _SOURCES else 'none'] += 1
            self._fixated = False
        # Only a status with a decision has a source; it stays until the next one.
        decision = {key: self.gate.get(key, '-') for key in ('source', 'p_lm')}
        self.gate = {**decision, **_shortened(values)}

    def record_trial(self, success: bool, now_s: float) -> None:
        """Record the score of a trial."""
        try:
            p_lm = float(self.gate.get('p_lm', '-'))
        except ValueError:
            p_lm = math.nan  # no decision yet
        self.curve.record_trial(success, p_lm, now_s - self._start_s)

    def record_health(self, health: NodeHealth) -> None:
        """Record the health of a node; of too many nodes, the longest silent one is left out."""
        node = _short(health.node)
        self._node_health.pop(node, None)
        self._node_health[node] = replace(
            health, node=node, message=_short(health.message), values=_shortened(health.values)
        )
        if len(self._node_health) > _MOST_NODES:
            del self._node_health[next(iter(self._node_health))]

    def append_log(self, line: str) -> None:
        """Append a line of a node's log, or the answer to a button."""
        self.log_lines += 1
        self.log.append((self.log_lines, _short(line, _LONGEST_LINE)))

    def node_health(self, now_s: float) -> list[NodeHealth]:
        """Return the health of all nodes so far, in the order of their names."""
        return [self._node_health[name].at(now_s) for name in sorted(self._node_health)]

    def state(self, now_s: float) -> State:
        """Return what the graph is doing; without new images it is never `RUNNING`."""
        silent_s = now_s - self._new_image_s
        if silent_s < STOPPED_AFTER_S and self._stamp_ns is not None:
            if reason := self.gate.get('reason'):
                return State(RunState.HELD, f'the gate holds the head: {reason}')
            return State(RunState.RUNNING, self._activity())
        if self._stamp_ns is None and silent_s < STOPPED_AFTER_S:
            return State(RunState.WAITING, 'waiting for the first image')
        repeated = now_s - self._any_image_s < STOPPED_AFTER_S
        if repeated and self._health_value('paused') == 'True':
            return State(RunState.PAUSED, 'the simulation is paused')
        return State(RunState.STOPPED, f'no new image for {silent_s:.0f} s')

    def _activity(self) -> str:
        phase, source = self.gate.get('phase', ''), self.gate.get('source', '')
        return _ACTIVITIES.get((phase, source)) or _ACTIVITIES.get((phase, ''), '')

    def switches(self) -> dict[str, bool]:
        """Return the known switches, on or off, by the service that sets them."""
        texts = {
            'gate/enable': self.gate.get('enabled', ''),
            'sim/pause': self._health_value('paused'),
        }
        return {service: text == 'True' for service, text in texts.items() if text}

    def facts(self) -> dict[str, str]:
        """Return the figures of the page in their order, without the unknown ones."""
        facts = {
            'phase': self.gate.get('phase', '-'),
            'source': self.gate.get('source', '-'),
            'p(LM)': self.gate.get('p_lm', '-'),
            'trials': self.gate.get('trials', '-'),
            'objects': self._health_value('objects'),
            'track': _short(self.track),
            'weight files': weight_files_text(self.weight_files).replace(' ', '\n'),
        }
        recent = self.curve.rate(slice(-WINDOW_TRIALS, None))
        if recent.trials:
            low, high = recent.interval
            facts[f'success, last {recent.trials}'] = f'{recent.rate:.2f} [{low:.2f}, {high:.2f}]'
        trials = sum(self.fixations.values())
        for source, count in sorted(self.fixations.items()):
            name = 'given up' if source == 'none' else f'fixated by {source}'
            facts[name] = f'{count / trials:.0%} of {trials}'
        return {name: text for name, text in facts.items() if text}

    def curve_points(self, now_s: float) -> CurvePoints:
        """Return the success curve, updated at most once a second; else the same object."""
        changed = self.curve.records and self._points.trials[-1:] != [len(self.curve.records)]
        if changed and now_s - self._drawn_s >= _CURVE_EVERY_S:
            self._points, self._drawn_s = CurvePoints.of(self.curve), now_s
        return self._points

    def _health_value(self, key: str) -> str:
        return next((h.values[key] for h in self._node_health.values() if key in h.values), '')


def _short(text: str, longest: int = _LONGEST_TEXT) -> str:
    return text if len(text) <= longest else f'{text[:longest]}...'


def _shortened(values: Mapping[str, str]) -> dict[str, str]:
    chosen = list(values.items())[:_MOST_VALUES]
    return {_short(key): _short(value) for key, value in chosen}


def _wilson(
    rates: NDArray[np.float64], trials: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wilson's 95 % interval of rates over so many trials each."""
    z = 1.959964
    centre = rates + z * z / (2 * trials)
    half = z * np.sqrt(rates * (1 - rates) / trials + (z / (2 * trials)) ** 2)
    whole = 1 + z * z / trials
    return (centre - half) / whole, (centre + half) / whole
