"""The 752-7-2 network: shapes, the step against finite differences, and what it learns."""

import numpy as np
import pytest

from ja_learning.core.network import ThreeLayerNetwork, face_inputs
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.trial import FACE_SHAPE, Trial

RNG = np.random.default_rng(5)
FACE = RNG.integers(0, 256, FACE_SHAPE).astype(np.uint8)
SCALE = NetworkConfig().angle_scale_rad


def make_trial(postures=((0.1, -0.05),), fixation=(0.5, 0.2), face=FACE):
    return Trial(face, np.array(postures[0]), np.array(postures), np.array(fixation))


def output(state, face, posture):
    """Compute the forward pass, written out [unit: angle scale]."""
    inputs = np.concatenate([face.ravel() / 255 - 0.5, np.array(posture) / SCALE])
    hidden = np.tanh(state['hidden_weights'] @ inputs + state['hidden_biases'])
    return state['output_weights'] @ hidden + state['output_biases']


def squared_error(state, trial):
    error = output(state, trial.face, trial.postures[0]) - trial.displacements()[0] / SCALE
    return 0.5 * np.sum(error**2)


def as_float64(state):
    return {name: np.array(array, float) for name, array in state.items()}


def test_units_of_the_paper():
    state = ThreeLayerNetwork(NetworkConfig(), seed=0).state()
    assert state['hidden_weights'].shape == (7, 30 * 25 + 2)
    assert state['output_weights'].shape == (2, 7)
    assert np.abs(state['hidden_weights']).max() == pytest.approx(0.05, rel=1e-3)


def test_prediction_is_tanh_then_linear_scaled_to_the_joint_range():
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    wanted = SCALE * output(as_float64(network.state()), FACE, (0.3, -0.1))
    assert network.predict(FACE, (0.3, -0.1)) == pytest.approx(wanted, abs=1e-6)


def test_seed_decides_the_start():
    def start(seed):
        return ThreeLayerNetwork(NetworkConfig(), seed).predict(FACE, (0.0, 0.0))

    assert np.array_equal(start(1), start(1))
    assert not np.array_equal(start(1), start(2))


@pytest.mark.parametrize('name', ['hidden_weights', 'hidden_biases', 'output_weights'])
def test_step_goes_down_the_squared_error(name):
    """Against central differences in double precision."""
    network = ThreeLayerNetwork(NetworkConfig(learning_rate=0.1, momentum=0.0), seed=0)
    before, trial = as_float64(network.state()), make_trial()
    network.update(trial)
    step = network.state()[name] - before[name]
    for index in list(np.ndindex(step.shape))[:: max(1, step.size // 20)]:
        either_side = []
        for nudge in (1e-5, -1e-5):
            nudged = {key: array.copy() for key, array in before.items()}
            nudged[name][index] += nudge
            either_side.append(squared_error(nudged, trial))
        slope = (either_side[0] - either_side[1]) / 2e-5
        assert step[index] == pytest.approx(-0.1 * slope, rel=1e-3, abs=1e-7)


def test_momentum_carries_the_last_step_on():
    def bias_steps(momentum):
        config = NetworkConfig(learning_rate=0.001, momentum=momentum)
        network = ThreeLayerNetwork(config, seed=0)
        path = [network.state()['output_biases']]
        for _ in range(2):
            network.update(make_trial())
            path.append(network.state()['output_biases'])
        return np.diff(path, axis=0)

    plain, carried = bias_steps(0.0), bias_steps(0.5)
    assert carried[0] == pytest.approx(plain[0])
    assert carried[1] == pytest.approx(plain[1] + 0.5 * plain[0], rel=0.02)


def test_all_pairs_are_learned_in_order_or_only_the_last():
    postures = [(0.0, 0.0), (0.2, 0.1), (0.4, 0.1)]

    def learned(pairs, *trials):
        network = ThreeLayerNetwork(NetworkConfig(pairs=pairs), seed=0)
        for trial in trials:
            network.update(trial)
        return network.state()

    one_by_one = [make_trial([posture]) for posture in postures]
    whole = make_trial(postures)
    for name in ('hidden_weights', 'output_biases'):
        assert np.array_equal(learned('all', whole)[name], learned('all', *one_by_one)[name])
        assert np.array_equal(learned('last', whole)[name], learned('all', one_by_one[-1])[name])
    assert learned('all', whole)['trials'] == 1


def test_the_last_error_is_in_radians():
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    assert np.isnan(network.last_error_rad)
    trial = make_trial()
    wanted = np.linalg.norm(network.predict(FACE, trial.postures[0]) - trial.displacements()[0])
    network.update(trial)
    assert network.last_error_rad == pytest.approx(wanted, rel=1e-4)


def test_it_learns_where_a_bright_spot_points_from_any_posture():
    """A linear toy: the spot's column and row give the direction of the fixation."""
    rng = np.random.default_rng(0)

    def draw():
        row, column = rng.integers(3, 27), rng.integers(3, 22)
        face = np.full(FACE_SHAPE, 64, np.uint8)
        face[row - 3 : row + 4, column - 3 : column + 4] = 255
        direction = np.array([(column - 12) / 12 * 0.6, (row - 15) / 15 * 0.25])
        return Trial(face, np.zeros(2), rng.uniform(-0.1, 0.1, (1, 2)), direction)

    def error():
        left = [
            network.predict(trial.face, trial.postures[0]) - trial.displacements()[0]
            for trial in tests
        ]
        return np.mean(np.linalg.norm(left, axis=1))

    network = ThreeLayerNetwork(NetworkConfig(learning_rate=0.02), seed=0)
    tests = [draw() for _ in range(100)]
    before = error()
    for _ in range(1500):
        network.update(draw())
    assert before > 0.25
    assert error() < 0.5 * before


def test_state_restored_continues_bit_for_bit():
    first = ThreeLayerNetwork(NetworkConfig(), seed=0)
    for _ in range(3):
        first.update(make_trial())
    second = ThreeLayerNetwork(NetworkConfig(), seed=99)
    second.restore(first.state())
    for network in (first, second):
        network.update(make_trial([(0.2, 0.0), (0.3, 0.1)]))
    one, other = first.state(), second.state()
    assert one.keys() == other.keys()
    assert all(np.array_equal(one[name], other[name]) for name in one)
    assert second.trials == 4


def test_the_initial_state_restores_the_initial_network():
    trained = ThreeLayerNetwork(NetworkConfig(), seed=0)
    untrained = trained.state()
    trained.update(make_trial())
    trained.restore(untrained)
    fresh = ThreeLayerNetwork(NetworkConfig(), seed=0)
    for network in (trained, fresh):
        network.update(make_trial())
    assert np.array_equal(trained.state()['hidden_weights'], fresh.state()['hidden_weights'])


@pytest.mark.parametrize(
    ('change', 'text'),
    [
        ({'output_biases': None}, 'output_biases is missing'),
        ({'trials': None}, 'trials is missing'),
        ({'hidden_weights': np.zeros((9, 752), 'f4')}, r'shape \(7, 752\), found .* \(9, 752\)'),
        ({'output_biases': np.array([np.nan, 0.0], 'f4')}, 'output_biases must hold numbers'),
        ({'output_biases': np.array(['a', 'b'])}, 'output_biases must be float32'),
        ({'momentum_output_biases': np.zeros(5)}, 'momentum_output_biases must be'),
    ],
)
def test_state_of_another_network_is_refused_and_nothing_changes(change, text):
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    wrong = ThreeLayerNetwork(NetworkConfig(), seed=1).state() | change
    wrong = {name: array for name, array in wrong.items() if array is not None}
    before = network.predict(FACE, (0.0, 0.0))
    with pytest.raises(ValueError, match=text):
        network.restore(wrong)
    assert np.array_equal(network.predict(FACE, (0.0, 0.0)), before)


def test_standardised_faces_forget_exposure_and_contrast():
    faces = np.stack([FACE // 2, FACE // 2 + 60])
    assert face_inputs(faces, 'standardised').shape == (2, 750)
    dark, bright = face_inputs(faces, 'standardised')
    assert dark == pytest.approx(bright)
    assert (dark.mean(), dark.std()) == pytest.approx((0.0, 1.0))
    dark, bright = face_inputs(faces, 'centred')
    assert bright - dark == pytest.approx(60 / 255)
    assert np.isfinite(face_inputs(np.zeros(FACE_SHAPE, np.uint8), 'standardised')).all()


def test_network_without_posture_does_not_see_it():
    network = ThreeLayerNetwork(NetworkConfig(posture_input=False), seed=0)
    assert np.array_equal(network.predict(FACE, (0.5, 0.2)), network.predict(FACE, (0.0, 0.0)))


def test_a_trial_that_was_given_up_changes_nothing():
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    before = network.state()
    network.update(Trial(FACE, np.zeros(2), np.zeros((1, 2)), None, np.ones((2, 2)), 2))
    after = network.state()
    assert all(np.array_equal(before[name], after[name]) for name in before)
