"""The experiment of section 3 as one compiled loop over whole trials.

It computes what `reference.py` computes, trial by trial, with the same draws in the same order
from the same generator (Numba continues the stream of a NumPy generator), and weights in float32
as in the network of the nodes. Only the order of summation differs; a test compares the two.

Two things make it fast: compilation, and that the face does not change within a trial. All pairs
of a trial therefore need one pass over the weights of the pixels (see `_update_weights`).

The compiled functions and the tuples that they take stay in this one file: Numba's cache is
invalidated only by changes of the file that holds the cached function.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ja_common.core.geometry import vectors_of_directions
from ja_experiments.config import ExperimentConfig
from ja_experiments.datasets.looks import Looks
from ja_experiments.paper.outcomes import NOTHING, Outcomes
from ja_experiments.paper.task import ATTENDED
from ja_learning.core.compiled import compiled
from ja_learning.core.network import ThreeLayerNetwork, face_inputs
from ja_learning.core.trial import SAME_POSTURE_RAD
from ja_sim.core.specs import ObjectsSpec

_FASTMATH = {'reassoc', 'contract', 'nsz'}  # sums may be taken in any order: eight at a time


class _Rules(NamedTuple):
    """The configuration as numbers; angles [rad], limits of the view as rays."""

    objects: int
    reliability: float
    shakes: float
    alpha: tuple[float, float, float]
    pan_low: float
    pan_high: float
    tilt_low: float
    tilt_high: float
    cos_gap_to_face: float
    cos_gap: float
    view_x: float
    view_y: float
    constant_gate: bool
    centre: float
    slope: float
    p_lm_max: float
    every_shift: bool
    max_shifts: int
    gain: float
    least_pan: float
    most_pan: float
    least_tilt: float
    most_tilt: float
    d_th_ray: float
    nearest: bool
    teach_executed: bool
    all_pairs: bool
    learning_rate: float
    momentum: float
    angle_scale: float
    posture_input: float
    same_posture: float


class PreparedLooks(NamedTuple):
    """The looks in the form that the kernel takes; `vectors` are unit vectors to the face."""

    inputs: NDArray[np.float32]
    postures: NDArray[np.float64]
    directions: NDArray[np.float64]
    vectors: NDArray[np.float64]


class _Weights(NamedTuple):
    """The network's parameters, and the momentum of each."""

    hidden: NDArray[np.float32]
    hidden_bias: NDArray[np.float32]
    output: NDArray[np.float32]
    output_bias: NDArray[np.float32]
    hidden_momentum: NDArray[np.float32]
    hidden_bias_momentum: NDArray[np.float32]
    output_momentum: NDArray[np.float32]
    output_bias_momentum: NDArray[np.float32]


class FastExperiment:
    """One robot, from initial weights; equivalent to `ReferenceExperiment`, without the GIL."""

    def __init__(
        self, config: ExperimentConfig, places: ObjectsSpec, looks: Looks, seed: int
    ) -> None:
        self._places = places
        self._rules = _rules(config, places)
        self._looks = prepare(looks, config)
        self._rng = np.random.default_rng(seed)
        self._network = ThreeLayerNetwork(config.network, seed)
        self._weights = _weights(self._network)
        self._trials = 0
        self._learned = 0

    @property
    def network(self) -> ThreeLayerNetwork:
        """Return the network with its current weights."""
        names = ('hidden_weights', 'hidden_biases', 'output_weights', 'output_biases')
        keys = (*names, *(f'momentum_{name}' for name in names))
        learned = dict(zip(keys, self._weights, strict=True))
        trials = {'trials': np.array(self._learned)}
        self._network.restore(self._network.state() | learned | trials)
        return self._network

    def run(self, trials: int) -> Outcomes:
        """Run the next so many trials; return their outcomes."""
        return self._run(trials, self._rules, self._looks, self._rng, learning=True)

    def test(
        self, config: ExperimentConfig, looks: PreparedLooks, trials: int, seed: int
    ) -> Outcomes:
        """Run trials without learning, on any looks and with any config; return their outcomes."""
        rng = np.random.default_rng(seed)
        return self._run(trials, _rules(config, self._places), looks, rng, learning=False)

    def predict(self, looks: PreparedLooks) -> NDArray[np.float64]:
        """Return the command that the network proposes at every look, (n, 2) [rad]."""
        return _predict(self._rules, self._weights, looks)

    def _run(
        self,
        trials: int,
        rules: _Rules,
        looks: PreparedLooks,
        rng: np.random.Generator,
        learning: bool,
    ) -> Outcomes:
        outcomes = Outcomes.blank(trials)
        learned = _run_trials(
            rules,
            looks,
            self._weights,
            rng,
            self._trials,
            learning,
            outcomes.fixated,
            outcomes.in_view,
            outcomes.pan_rad,
            outcomes.shifts,
        )
        if learning:
            self._trials += trials
            self._learned += learned
        return outcomes


def _rules(config: ExperimentConfig, places: ObjectsSpec) -> _Rules:
    task, gating, network, limits = config.task, config.gating, config.network, config.limits
    interest = config.interest
    pan, tilt = np.radians(places.pan_deg), np.radians(places.tilt_deg)
    return _Rules(
        objects=task.objects,
        reliability=task.reliability,
        shakes=float(task.shakes_object),
        alpha=(interest.alpha_col, interest.alpha_edg, interest.alpha_mot),
        pan_low=float(pan[0]),
        pan_high=float(pan[1]),
        tilt_low=float(tilt[0]),
        tilt_high=float(tilt[1]),
        cos_gap_to_face=math.cos(math.radians(places.gap_to_face_deg)),
        cos_gap=math.cos(math.radians(places.gap_deg)),
        view_x=math.tan(task.view_pan_rad),
        view_y=math.tan(task.view_tilt_rad),
        constant_gate=gating.gating == 'constant',
        centre=gating.sigmoid_centre_trials,
        slope=gating.sigmoid_slope_trials,
        p_lm_max=gating.p_lm_max,
        every_shift=config.cycle.source_drawn == 'every_shift',
        max_shifts=config.cycle.max_shifts,
        gain=config.visual_feedback.gain,
        least_pan=limits.pan_min_rad,
        most_pan=limits.pan_max_rad,
        least_tilt=limits.tilt_min_rad,
        most_tilt=limits.tilt_max_rad,
        d_th_ray=math.tan(config.evaluator.d_th_rad),
        nearest=config.evaluator.candidate == 'nearest',
        teach_executed=task.taught == 'executed',
        all_pairs=network.pairs == 'all',
        learning_rate=network.learning_rate,
        momentum=network.momentum,
        angle_scale=network.angle_scale_rad,
        posture_input=float(network.posture_input),
        same_posture=SAME_POSTURE_RAD,
    )


def prepare(looks: Looks, config: ExperimentConfig) -> PreparedLooks:
    """Prepare looks for the kernel; do it once, because it scales every pixel."""
    return PreparedLooks(
        inputs=face_inputs(looks.faces, config.network.face_scaling).astype(np.float32),
        postures=looks.postures,
        directions=looks.directions,
        vectors=vectors_of_directions(looks.faces_at),
    )


def _weights(network: ThreeLayerNetwork) -> _Weights:
    state = network.state()
    names = ('hidden_weights', 'hidden_biases', 'output_weights', 'output_biases')
    parameters = [state[name] for name in names]
    return _Weights(*parameters, *(np.zeros_like(array) for array in parameters))


@compiled
def _run_trials(  # type: ignore[no-untyped-def]
    rules, looks, weights, rng, trials_before, learning, fixated, in_view, pan_rad, shifts
):
    """Run `len(fixated)` trials; return the number of trials that were learned from."""
    vectors = np.empty((rules.objects, 3))
    directions = np.empty((rules.objects, 2))
    scores = np.empty(rules.objects)
    postures = np.empty((rules.max_shifts + 1, 2))
    drive = np.empty(len(weights.hidden), np.float32)
    learned = 0
    for trial in range(len(fixated)):
        p_lm = _p_lm(rules, trials_before + trial)
        look = _draw_setting(rules, looks, rng, vectors, directions, scores)
        pan, tilt = looks.postures[look]
        face = looks.vectors[look]
        pixels = looks.inputs[look]
        x, y = _ray(_head(pan, tilt), vectors[ATTENDED])
        in_view[trial] = abs(x) < rules.view_x and abs(y) < rules.view_y
        _drive(weights.hidden, pixels, drive)
        postures[0, 0], postures[0, 1] = pan, tilt
        visited = 1
        follows_learner = False
        while True:
            if shifts[trial] == 0 or rules.every_shift:
                follows_learner = rng.random() < p_lm
            if follows_learner:
                pan_delta, tilt_delta = _propose(rules, weights, drive, pan, tilt)
            else:
                pan_delta, tilt_delta = _visual_feedback(rules, pan, tilt, vectors, scores)
            pan = min(max(pan + pan_delta, rules.least_pan), rules.most_pan)
            tilt = min(max(tilt + tilt_delta, rules.least_tilt), rules.most_tilt)
            shifts[trial] += 1
            found = _fixated(rules, pan, tilt, face, vectors, scores)
            if found != NOTHING or shifts[trial] == rules.max_shifts:
                break
            if not _same(rules, pan, tilt, postures[visited - 1]):
                postures[visited, 0], postures[visited, 1] = pan, tilt
                visited += 1
        if found == NOTHING:
            continue
        fixated[trial] = found
        pan_rad[trial] = directions[found, 0] - looks.postures[look, 0]
        if _same(rules, pan, tilt, postures[visited - 1]):
            visited -= 1  # no shift began where the last one ended
        if learning and visited:
            if rules.teach_executed:
                end_pan, end_tilt = pan, tilt
            else:
                end_pan, end_tilt = directions[found]
            first = 0 if rules.all_pairs else visited - 1
            _update_weights(
                rules, weights, pixels, drive, postures[first:visited], end_pan, end_tilt
            )
            learned += 1
    return learned


@njit(nogil=True)
def _p_lm(rules, trials):  # type: ignore[no-untyped-def]
    if rules.constant_gate:
        return rules.p_lm_max
    return rules.p_lm_max * 0.5 * (1 + math.tanh((trials - rules.centre) / rules.slope / 2))


@njit(nogil=True)
def _draw_setting(rules, looks, rng, vectors, directions, scores):  # type: ignore[no-untyped-def]
    """As `SimulatedTask.draw_setting`: return the index of the look; fill the arrays."""
    look = int(rng.random() * len(looks.postures))
    reliable = rng.random() < rules.reliability
    for index in range(rules.objects):
        if index == ATTENDED and reliable:
            directions[index] = looks.directions[look]
            _point(directions[index], vectors[index])
        else:
            _free_place(rules, rng, looks.vectors[look], vectors, directions, index)
    for index in range(rules.objects):
        f_col, f_edg = rng.random(), rng.random()
        f_mot = rules.shakes if index == ATTENDED else 0.0
        alpha_col, alpha_edg, alpha_mot = rules.alpha
        scores[index] = alpha_col * f_col + alpha_edg * f_edg + alpha_mot * f_mot
    return look


@njit(nogil=True)
def _free_place(rules, rng, face, vectors, directions, index):  # type: ignore[no-untyped-def]
    direction, vector = directions[index], vectors[index]
    while True:
        direction[0] = rules.pan_low + (rules.pan_high - rules.pan_low) * rng.random()
        direction[1] = rules.tilt_low + (rules.tilt_high - rules.tilt_low) * rng.random()
        _point(direction, vector)
        free = _dot(face, vector) < rules.cos_gap_to_face
        for other in range(index):
            free = free and _dot(vectors[other], vector) < rules.cos_gap
        if free:
            return


@njit(nogil=True)
def _point(direction, vector):  # type: ignore[no-untyped-def]
    pan, tilt = direction
    vector[0] = math.cos(tilt) * math.cos(pan)
    vector[1] = math.cos(tilt) * math.sin(pan)
    vector[2] = -math.sin(tilt)


@njit(nogil=True)
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(nogil=True)
def _head(pan, tilt):  # type: ignore[no-untyped-def]
    """Return cosines and sines of a posture, for `_ray`."""
    return math.cos(pan), math.sin(pan), math.cos(tilt), math.sin(tilt)


@njit(nogil=True)
def _ray(head, vector):  # type: ignore[no-untyped-def]
    """Return the ray (x, y) of a vector for a posture of the head; NaN if it is behind."""
    cp, sp, ct, st = head
    level = cp * vector[0] + sp * vector[1]
    forward = ct * level - st * vector[2]
    if forward <= 1e-9:
        return math.nan, math.nan
    left = cp * vector[1] - sp * vector[0]
    up = st * level + ct * vector[2]
    return -left / forward, -up / forward


@njit(nogil=True)
def _visual_feedback(rules, pan, tilt, vectors, scores):  # type: ignore[no-untyped-def]
    """Compute Eq. 2 for the most salient object in view; (0, 0) when none is in view."""
    head = _head(pan, tilt)
    best = 0.0
    pan_delta = tilt_delta = 0.0
    for index in range(rules.objects):
        if scores[index] > best:
            x, y = _ray(head, vectors[index])
            if abs(x) < rules.view_x and abs(y) < rules.view_y:
                best = scores[index]
                pan_delta, tilt_delta = -rules.gain * x, rules.gain * y
    return pan_delta, tilt_delta


@njit(nogil=True)
def _fixated(rules, pan, tilt, face, vectors, scores):  # type: ignore[no-untyped-def]
    """Evaluate Eq. 3: index of the object in the centre; NOTHING if none, or if the face is."""
    head = _head(pan, tilt)
    found, nearest, best = NOTHING, math.inf, 0.0  # distances are squared
    for index in range(rules.objects):
        x, y = _ray(head, vectors[index])
        if scores[index] > 0 and abs(x) < rules.view_x and abs(y) < rules.view_y:
            away = x * x + y * y
            if (rules.nearest and away < nearest) or (not rules.nearest and scores[index] > best):
                found, nearest, best = index, away, scores[index]
    if not nearest < rules.d_th_ray**2:
        return NOTHING
    x, y = _ray(head, face)
    face_in_view = abs(x) < rules.view_x and abs(y) < rules.view_y
    return NOTHING if face_in_view and x * x + y * y < nearest else found


@njit(nogil=True)
def _same(rules, pan, tilt, posture):  # type: ignore[no-untyped-def]
    return (
        abs(pan - posture[0]) < rules.same_posture and abs(tilt - posture[1]) < rules.same_posture
    )


@njit(nogil=True, fastmath=_FASTMATH)
def _drive(matrix, pixels, drive):  # type: ignore[no-untyped-def]
    """Compute what the pixels alone contribute to each hidden unit."""
    for unit in range(len(drive)):
        total = np.float32(0)
        for index in range(len(pixels)):
            total += matrix[unit, index] * pixels[index]
        drive[unit] = total


@njit(nogil=True)
def _hidden(rules, weights, unit, drive, pan, tilt):  # type: ignore[no-untyped-def]
    row = weights.hidden[unit]
    posture = row[-2] * _angle(rules, pan) + row[-1] * _angle(rules, tilt)
    return math.tanh(drive + posture + weights.hidden_bias[unit])


@njit(nogil=True)
def _angle(rules, angle):  # type: ignore[no-untyped-def]
    return np.float32(angle / rules.angle_scale * rules.posture_input)


@njit(nogil=True)
def _propose(rules, weights, drive, pan, tilt):  # type: ignore[no-untyped-def]
    pan_out, tilt_out = float(weights.output_bias[0]), float(weights.output_bias[1])
    for unit in range(len(drive)):
        hidden = _hidden(rules, weights, unit, drive[unit], pan, tilt)
        pan_out += weights.output[0, unit] * hidden
        tilt_out += weights.output[1, unit] * hidden
    return pan_out * rules.angle_scale, tilt_out * rules.angle_scale


@compiled
def _predict(rules, weights, looks):  # type: ignore[no-untyped-def]
    commands = np.empty((len(looks.inputs), 2))
    drive = np.empty(len(weights.hidden), np.float32)
    for look in range(len(looks.inputs)):
        _drive(weights.hidden, looks.inputs[look], drive)
        pan, tilt = looks.postures[look]
        commands[look] = _propose(rules, weights, drive, pan, tilt)
    return commands


@njit(nogil=True)
def _update_weights(rules, weights, pixels, drive, postures, end_pan, end_tilt):  # type: ignore[no-untyped-def]
    """Take one step of back-propagation with momentum for each pair; all have the same face.

    Every step k gives the momentum v of a hidden unit's pixel weights w a multiple of the same
    pixels x: v_k = mu v_(k-1) + d_k x, w_k = w_(k-1) - eta v_k. Hence v_k = mu^k v_0 + a_k x and
    w_k = w_0 - eta (s_k v_0 + b_k x), and the input of the unit from the pixels, w_k . x,
    follows from three sums over pixels taken once. The steps need numbers only; w and v are
    written once.
    """
    units = len(drive)
    mu, eta = rules.momentum, rules.learning_rate
    push, energy = _products(weights.hidden_momentum, pixels)
    kept, kept_sum = 1.0, 0.0
    a, b, hidden, wrong = np.zeros(units), np.zeros(units), np.empty(units), np.empty(2)
    for pan, tilt in postures:
        wrong[0] = weights.output_bias[0] - (end_pan - pan) / rules.angle_scale
        wrong[1] = weights.output_bias[1] - (end_tilt - tilt) / rules.angle_scale
        for unit in range(units):
            pixel_input = drive[unit] - eta * (kept_sum * push[unit] + b[unit] * energy)
            hidden[unit] = _hidden(rules, weights, unit, pixel_input, pan, tilt)
            for axis in range(2):
                wrong[axis] += weights.output[axis, unit] * hidden[unit]
        kept *= mu
        kept_sum += kept
        for unit in range(units):
            back = weights.output[0, unit] * wrong[0] + weights.output[1, unit] * wrong[1]
            delta = (1 - hidden[unit] ** 2) * back
            a[unit] = mu * a[unit] + delta
            b[unit] += a[unit]
            row, momentum = weights.hidden[unit], weights.hidden_momentum[unit]
            _momentum_step(rules, row, momentum, -2, delta * _angle(rules, pan))
            _momentum_step(rules, row, momentum, -1, delta * _angle(rules, tilt))
            _momentum_step(rules, weights.hidden_bias, weights.hidden_bias_momentum, unit, delta)
            for axis in range(2):
                gradient = wrong[axis] * hidden[unit]
                _momentum_step(
                    rules, weights.output[axis], weights.output_momentum[axis], unit, gradient
                )
        for axis in range(2):
            _momentum_step(
                rules, weights.output_bias, weights.output_bias_momentum, axis, wrong[axis]
            )
    _write_pixel_weights(
        weights.hidden, weights.hidden_momentum, pixels, kept, a, -eta * kept_sum, -eta * b
    )


@njit(nogil=True)
def _momentum_step(rules, array, momentum, index, gradient):  # type: ignore[no-untyped-def]
    momentum[index] = rules.momentum * momentum[index] + gradient
    array[index] -= rules.learning_rate * momentum[index]


@njit(nogil=True, fastmath=_FASTMATH)
def _products(momentum, pixels):  # type: ignore[no-untyped-def]
    """Return the products of the pixels with each unit's momentum, and with themselves."""
    push = np.empty(len(momentum), np.float32)
    _drive(momentum, pixels, push)
    energy = np.float32(0)
    for index in range(len(pixels)):
        energy += pixels[index] * pixels[index]
    return push, energy


@njit(nogil=True, fastmath=_FASTMATH)
def _write_pixel_weights(matrix, momentum, pixels, kept, a, momentum_share, pixel_share):  # type: ignore[no-untyped-def]
    """Set w += momentum_share v + pixel_share x; v = kept v + a x, for every unit."""
    kept, momentum_share = np.float32(kept), np.float32(momentum_share)
    for unit in range(len(matrix)):
        of_pixels, into_momentum = np.float32(pixel_share[unit]), np.float32(a[unit])
        for index in range(len(pixels)):
            v, x = momentum[unit, index], pixels[index]
            matrix[unit, index] += momentum_share * v + of_pixels * x
            momentum[unit, index] = kept * v + into_momentum * x
