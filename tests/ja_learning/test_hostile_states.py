"""A state that a learner could not have written is refused in a sentence, and changes nothing."""

import numpy as np
import pytest

from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.network import ThreeLayerNetwork
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.trial import FACE_SHAPE, Trial

SMALL = GazeLineConfig(members=2, channels=2, replay_steps=1, replay_memory=30)


def trial(number: int) -> Trial:
    rng = np.random.default_rng(number)
    face = rng.integers(0, 255, FACE_SHAPE, np.uint8)
    places = rng.uniform(-0.5, 0.5, (3, 2))
    return Trial(face, np.zeros(2), np.zeros((1, 2)), places[0], places, 3)


def make(kind: str, seed: int, trials: int):
    if kind == 'paper':
        learner = ThreeLayerNetwork(NetworkConfig(), seed)
    else:
        learner = GazeLineLearner(SMALL, seed)
    for number in range(trials):
        learner.update(trial(number))
    return learner


@pytest.fixture(scope='module')
def learners():
    """Return, by kind, the state of a trained learner, and another one to restore it into."""
    return {kind: (make(kind, 0, 20).state(), make(kind, 1, 3)) for kind in ('paper', 'gaze_line')}


def states_are_equal(a, b) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)


def harm(array: np.ndarray) -> dict[str, np.ndarray | None]:
    """Return what may stand in the place of an array; None: nothing at all."""
    changed = {
        'missing': None,
        'another shape': np.zeros((*array.shape, 2), array.dtype),
        'text': np.full(array.shape, 'x'),
        'complex': array.astype(complex),
        'half': array.astype(np.float16),
        'truth values': array.astype(bool),
    }
    if array.dtype.kind == 'f':
        changed |= {
            'NaN': np.full_like(array, np.nan),
            'inf': np.full_like(array, -np.inf),
            '3e38': np.full_like(array, 3e38),
            'double': array.astype(np.longdouble),
            'the other bytes': array.astype(array.dtype.newbyteorder()),
        }
    if array.dtype.kind == 'i':
        changed |= {'negative': np.full_like(array, -1), 'a float': array.astype(float)}
    if not array.size:  # no numbers, and so none that are wrong
        keep = ('missing', 'another shape')
        changed = {k: v for k, v in changed.items() if k in keep}
    return changed


@pytest.mark.parametrize('kind', ['paper', 'gaze_line'])
def test_every_array_is_checked_and_nothing_changes_when_one_is_bad(kind, learners):
    state, learner = learners[kind]
    before = learner.state()
    accepted = []
    for name, array in state.items():
        for what, bad in harm(array).items():
            arrays = {**state, name: bad} if bad is not None else dict(state)
            if bad is None:
                del arrays[name]
            try:
                learner.restore(arrays)
            except ValueError as error:
                assert name.split('.')[-1] in str(error), (name, what)  # noqa: PT017
                assert len(str(error)) < 300  # noqa: PT017
                assert states_are_equal(learner.state(), before), (name, what)
            else:
                accepted.append((name, what))
                learner.restore(before)
    # Before its first step an optimiser without momentum has none to save.
    allowed = {(name, 'missing') for name in state if name.startswith('momentum_')}
    assert set(accepted) <= allowed


@pytest.mark.parametrize(
    'changes',
    [
        {'annealing': np.zeros(2)},
        {'began': np.array([-5, 0])},
        {'steps': np.array(-10)},
        {'doubt': np.array(-1.0)},
        {'candidate_counts': np.array([33] + [3] * 19)},
        {'candidate_counts': np.array([-3, 9] + [3] * 18)},
        {'candidate_counts': np.array([2**62] * 4 + [3] * 16)},
        {'random': np.zeros(5056, np.uint8)},
        {'random': np.full(5056, 255, np.uint8)},
    ],
    ids=lambda changes: repr(changes)[:40],
)
def test_numbers_that_would_fail_later_are_refused_at_once(changes, learners):
    state, learner = learners['gaze_line']
    before = learner.state()
    with pytest.raises(ValueError, match=next(iter(changes))):
        learner.restore({**state, **changes})
    assert states_are_equal(learner.state(), before)


@pytest.mark.parametrize('kind', ['paper', 'gaze_line'])
def test_a_whole_state_is_taken_and_learning_goes_on(kind, learners):
    state, _ = learners[kind]
    learner = make(kind, 2, 5)
    learner.restore(state)
    assert states_are_equal(learner.state(), state)
    learner.update(trial(50))
    assert learner.trials == 21
