"""The fast kernel computes the readable experiment, trial by trial, from the same draws."""

from typing import Any

import numpy as np
import pytest

from ja_experiments.config import READINGS, reading
from ja_experiments.datasets.looks import Looks
from ja_experiments.paper.kernel import FastExperiment, prepare
from ja_experiments.paper.outcomes import Outcomes
from ja_experiments.paper.reference import ReferenceExperiment
from ja_sim.core.specs import ObjectsSpec

# The gate opens half-way through the run: both modules and both ends of a trial occur.
GATE = {'sigmoid_centre_trials': 500, 'sigmoid_slope_trials': 150.0}
EVERY_OPTION_ELSE = {
    'candidate': 'most_salient',
    'source_drawn': 'first_shift',
    'gain': 0.9,
    'taught': 'executed',
    'posture_input': False,
    'face_scaling': 'standardised',
    'reliability': 0.7,
    'shakes_object': True,
    'alpha_mot': 0.5,
    'hidden': 12,
    'objects': 10,
}


def assert_same_outcomes(left: Outcomes, right: Outcomes) -> None:
    np.testing.assert_array_equal(left.fixated, right.fixated)
    np.testing.assert_array_equal(left.in_view, right.in_view)
    np.testing.assert_array_equal(left.shifts, right.shifts)
    np.testing.assert_allclose(left.pan_rad, right.pan_rad, atol=1e-6)


@pytest.mark.parametrize('settings', [{}, EVERY_OPTION_ELSE], ids=['paper', 'every option else'])
@pytest.mark.parametrize('pairs', READINGS)
def test_same_trials_and_same_weights_after_1000_trials(
    pairs: str, settings: dict[str, Any], looks: Looks, places: ObjectsSpec
) -> None:
    config = reading(pairs).with_settings(GATE | settings)
    readable = ReferenceExperiment(config, places, looks, seed=3)
    fast = FastExperiment(config, places, looks, seed=3)

    assert_same_outcomes(readable.run(1000), fast.run(1000))

    wanted, got = readable.network.state(), fast.network.state()
    untrained = ReferenceExperiment(config, places, looks, seed=3).network.state()
    assert got.keys() == wanted.keys()
    # The paper has no evidence: the kernel computes none.
    for name in wanted.keys() - {'evidence.nats', 'evidence.faces'}:
        array = wanted[name]
        np.testing.assert_allclose(got[name], array, rtol=0, atol=1e-5, err_msg=name)
    moved = np.abs(wanted['hidden_weights'] - untrained['hidden_weights']).max()
    assert moved > 1e-3, 'learning must have changed the weights by more than the tolerance'


def test_a_run_in_parts_is_the_same_run(looks: Looks, places: ObjectsSpec) -> None:
    config = reading('all').with_settings(GATE)
    whole = FastExperiment(config, places, looks, seed=1)
    parts = FastExperiment(config, places, looks, seed=1)

    outcomes = whole.run(2000)
    assert_same_outcomes(outcomes[:700], parts.run(700))
    parts.test(
        config, prepare(looks, config), trials=50, seed=9
    )  # learns nothing, and draws from its own stream
    assert_same_outcomes(outcomes[700:], parts.run(1300))
    for name, array in whole.network.state().items():
        np.testing.assert_array_equal(parts.network.state()[name], array)


def test_without_learning_visual_feedback_stays_at_chance(
    looks: Looks, places: ObjectsSpec
) -> None:
    # The caregiver never looks at the attended object: all five objects are placed alike.
    config = reading('all').with_settings(
        {'gating': 'constant', 'p_lm_max': 0.0, 'reliability': 0.0}
    )
    outcomes = FastExperiment(config, places, looks, seed=0).run(50_000)
    found = outcomes.fixated >= 0
    assert outcomes.success[found].mean() == pytest.approx(0.2, abs=0.01)
    assert outcomes.success[~outcomes.in_view].mean() < 0.1 < outcomes.success.mean()


def test_learning_raises_success_well_above_chance(looks: Looks, places: ObjectsSpec) -> None:
    config = reading('last').with_settings(
        {'sigmoid_centre_trials': 12_000, 'sigmoid_slope_trials': 1500, 'learning_rate': 0.02}
    )
    outcomes = FastExperiment(config, places, looks, seed=0).run(30_000)
    assert outcomes.success[-3000:].mean() > 0.6 > 0.3 > outcomes.success[:3000].mean()
    assert outcomes.success[-3000:][~outcomes.in_view[-3000:]].mean() > 0.5


def test_predictions_are_those_of_the_network(looks: Looks, places: ObjectsSpec) -> None:
    config = reading('last').with_settings({'face_scaling': 'standardised'})
    experiment = FastExperiment(config, places, looks, seed=0)
    experiment.run(3000)
    commands = experiment.predict(prepare(looks, config))
    wanted = experiment.network.predict(looks.faces, looks.postures)
    np.testing.assert_allclose(commands, wanted, atol=1e-5)
    assert np.std(wanted) > 0.01
