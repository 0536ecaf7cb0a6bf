"""The fast learner: its belief by numbers, and what it learns without labels."""

import dataclasses

import numpy as np
import pytest
import torch

from ja_learning.core.gaze_line import GazeLineLearner
from ja_learning.core.gaze_line_belief import GazeLineBelief
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.gaze_line_network import GazeLineNetwork, give_member
from ja_learning.core.gaze_line_pass import GazeLinePass
from ja_learning.core.gaze_line_places import ANGLE_SCALE_RAD
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.mean_face import contrast, standardised
from ja_learning.core.trial import Look, Trial

LOOK = np.array([0.1, -0.05])


def drawn_face(gaze: np.ndarray) -> np.ndarray:
    """Draw a grey face whose dark spot moves with the gaze (pan to the left, tilt down) [rad]."""
    rows, columns = np.mgrid[0:30, 0:25]
    column, row = 12 - 10 * gaze[0] / 0.7, 15 + 12 * gaze[1] / 0.3
    spot = np.exp(-((rows - row) ** 2 + (columns - column) ** 2) / 8)
    return (200 - 150 * spot).astype(np.uint8)


def made_trial(rng: np.random.Generator, objects: int = 4) -> tuple[Trial, int]:
    """Make a trial among `objects`: one is the attended object, another may be fixated."""
    places = rng.uniform([-0.6, -0.25], [0.6, 0.25], (objects, 2))
    attended, fixated = rng.integers(objects, size=2)
    return (
        Trial(
            drawn_face(places[attended]),
            LOOK,
            LOOK[None],
            LOOK + places[fixated],
            LOOK + places,
            objects,
        ),
        int(attended),
    )


def share_right(learner: GazeLineLearner, rng: np.random.Generator, trials: int = 100) -> float:
    right = 0
    for _ in range(trials):
        trial, attended = made_trial(rng)
        delta = learner.propose(trial.look, LOOK, trial.candidates)
        nearest = np.argmin(np.linalg.norm(trial.candidates - LOOK - delta, axis=1))
        right += nearest == attended
    return right / trials


@pytest.fixture
def learner() -> GazeLineLearner:
    return GazeLineLearner(GazeLineConfig(members=3, channels=4, first_guess='none'), seed=3)


def test_a_mirrored_face_gives_mirrored_pan_and_equal_tilt():
    network = GazeLineNetwork(members=2, channels=4)
    faces = torch.randn(5, 1, 30, 25)
    with torch.no_grad():
        gaze, mirrored = network.gaze(faces), network.gaze(faces.flip(-1))
    assert torch.allclose(mirrored, gaze * torch.tensor([-1.0, 1.0]), atol=1e-6)


def test_the_belief_is_a_density():
    network = GazeLineNetwork(members=2, channels=4)
    grid = torch.linspace(-4, 4, 401)
    places = torch.stack(torch.meshgrid(grid, grid, indexing='ij'), -1).reshape(1, 1, -1, 2)
    with torch.no_grad():
        density = network.log_density(torch.tensor([[[0.6, -0.3]], [[0.1, 0.5]]]), places).exp()
    assert density.shape[:2] == (2, 1)
    assert density.sum(-1).flatten().numpy() * 0.02**2 == pytest.approx([1.0, 1.0], abs=1e-3)


def test_lines_of_gaze_begin_at_a_tilt_of_their_own():
    network = GazeLineNetwork(members=1, channels=4)
    gaze, straight = torch.tensor([[[0.6, 0.0]]]), torch.tensor([[[[0.6, 0.0]]]])
    with torch.no_grad():
        before = network.log_density(gaze, straight)
        network.origin_tilt.fill_(-0.2)
        raised = network.log_density(gaze, straight - torch.tensor([0.0, 0.2]))
        _, tilt = network.mixture().on_line(*gaze.split(1, dim=-1))
        assert tilt.flatten().tolist() == pytest.approx([-0.2] * 9)
    assert torch.allclose(raised, before)


def test_where_lines_begin_is_learned_by_members_that_have_cooled_alone(learner):
    rng = np.random.default_rng(1)
    # Members cool within 4, 11 and 32 trials with four objects.
    for trial, cooled in ((3, 0), (8, 1), (20, 2), (40, 3)):
        while learner.trials < trial:
            learner.update(made_trial(rng)[0])
        moved = learner.state()['network.origin_tilt'][:, 0] != 0.0
        assert moved.tolist() == [member < cooled for member in range(3)]


def test_it_learns_from_where_the_face_is_not_from_where_the_head_points(learner):
    other = GazeLineLearner(learner.config, seed=3)
    rng = np.random.default_rng(1)
    for _ in range(5):
        trial, _ = made_trial(rng)
        learner.update(trial)
        other.update(dataclasses.replace(trial, postures=trial.postures + 0.03))
    same = [learner.state(), other.state()]
    assert all(np.array_equal(same[0][name], same[1][name]) for name in same[0])


def test_members_do_not_depend_on_each_other():
    network = GazeLineNetwork(members=3, channels=4)
    faces = torch.randn(2, 1, 30, 25)
    with torch.no_grad():
        before = network.gaze(faces)
        for parameter in network.parameters():
            give_member(parameter, 3, giver=0, taker=2)
        after = network.gaze(faces)
    assert torch.equal(before[:2], after[:2])
    assert torch.allclose(after[2], before[0], atol=1e-6)
    assert not torch.allclose(before[2], before[0], atol=1e-3)


def test_samples_of_the_belief_are_as_its_density_says(learner):
    face = drawn_face(np.array([0.4, 0.1]))
    samples = learner.belief(Look(face, LOOK), np.random.default_rng(0), 4000)
    assert samples.shape == (4000, 2)
    # E[-log p] of a density's own samples is its entropy: the same from two independent halves,
    # and lower than that of the samples moved aside.
    halves = np.split(samples, 2)
    entropy = [
        -learner.snapshot().log_density(standardised(face)[None], LOOK, half).mean()
        for half in halves
    ]
    assert entropy[0] == pytest.approx(entropy[1], abs=0.1)
    aside = learner.snapshot().log_density(standardised(face)[None], LOOK, samples + 0.1)
    assert -aside.mean() > np.mean(entropy) + 0.3


def test_depth_is_uncertain_along_the_line_of_gaze_and_not_across():
    network = GazeLineNetwork(members=1, channels=4)
    gaze = torch.tensor([[[0.5, 0.2]]])
    along = gaze[:, :, None] * torch.tensor([0.5, 1.0, 1.8])[:, None]
    across = gaze[:, :, None] + torch.tensor([-0.25, 0.6])
    with torch.no_grad():
        assert network.log_density(gaze, along).min() > network.log_density(gaze, across).max() + 5


@pytest.mark.parametrize(('members', 'channels'), [(1, 3), (3, 8)])
def test_the_compiled_pass_gives_the_gazes_of_the_network(members, channels):
    torch.manual_seed(0)
    network = GazeLineNetwork(members, channels)
    faces = np.random.default_rng(0).normal(size=(4, 30, 25)).astype(np.float32)
    faces[3] = 0  # nothing to be seen in it
    with torch.no_grad():
        gaze = network.gaze(torch.from_numpy(faces[:, None])).numpy()
    compiled = GazeLinePass(network)
    assert compiled(faces) == pytest.approx(gaze, abs=1e-6)
    assert np.ptp(gaze[:, :3], axis=1).min() > 1e-3
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(1.0)
    assert compiled(faces) == pytest.approx(gaze, abs=1e-6)


def test_the_belief_in_numpy_equals_the_network_in_torch():
    network = GazeLineNetwork(members=2, channels=4)
    rng = np.random.default_rng(0)
    faces = rng.normal(size=(3, 30, 25)).astype(np.float32)
    places = rng.uniform(-0.5, 0.5, (7, 2))
    with torch.no_grad():
        network.stretch_logits.normal_()
        network.origin_tilt.fill_(-0.1)
        gaze = network.gaze(torch.from_numpy(faces[:, None]))
        scaled = torch.from_numpy(places / ANGLE_SCALE_RAD).float()[None, None]
        learned = network.log_density(gaze, scaled).numpy() - 2 * np.log(ANGLE_SCALE_RAD)
    for member in range(2):
        weights = np.where(np.arange(2) == member, 0.0, -np.inf)
        belief = GazeLineBelief(
            contrast,
            GazeLinePass(network),
            network.mixture().as_numpy(),
            weights,
            0.0,
            True,
            4.5,
        )
        asked = belief.log_density(faces, LOOK, LOOK + places)
        assert asked == pytest.approx(learned[member], abs=1e-3)


def test_weights_that_code_a_face_decay_and_the_numbers_of_the_belief_do_not():
    def trained(weight_decay: float) -> dict[str, np.ndarray]:
        config = GazeLineConfig(
            members=2, channels=4, first_guess='none', weight_decay=weight_decay
        )
        learner, rng = GazeLineLearner(config, seed=3), np.random.default_rng(1)
        for _ in range(5):
            learner.update(made_trial(rng)[0])
        return learner.state()

    freely, decaying = trained(0.0), trained(20.0)
    # 20 steps, each of which takes 6 % of every weight.
    for name in ('coder.0.weight', 'coder.4.weight', 'hidden_weights', 'gaze_weights'):
        name = f'network.{name}'
        assert np.linalg.norm(decaying[name]) < 0.5 * np.linalg.norm(freely[name])
    for name in ('gaze', 'stretch', 'place'):
        name = f'network.log_{name}_deviation'
        assert decaying[name] == pytest.approx(freely[name], abs=0.2)


def test_ratios_are_to_the_mean_of_all_places_that_were_seen():
    network = GazeLineNetwork(members=2, channels=4)
    gaze = torch.tensor([[[0.6, -0.3]], [[0.1, 0.5]]])
    random = torch.Generator().manual_seed(0)
    places, negatives = torch.full((1, 1, 3, 8), torch.nan), torch.full((2, 7, 8), torch.nan)
    places[..., :2] = torch.randn(1, 1, 3, 2, generator=random) / 2
    negatives[..., :2] = torch.randn(2, 7, 2, generator=random) / 2
    places[0, 0, 2] = torch.nan
    with torch.no_grad():
        ratio = network.log_ratio(gaze, places, negatives).exp()
        of_others = network.log_ratio(gaze, negatives[:, None], places[:, 0, :2].expand(2, -1, -1))
        same = network.log_ratio(gaze, negatives[:, None, :1], negatives[:, :1].expand(2, 5, 8))
    assert ratio.shape == (2, 1, 3)
    assert ratio[..., 2].tolist() == [[0.0], [0.0]], 'what is not there'
    mean = (ratio.sum(-1) + of_others.exp().sum(-1)) / 9
    assert mean.flatten().tolist() == pytest.approx([1.0, 1.0], rel=1e-5)
    assert same.flatten().tolist() == pytest.approx([0.0, 0.0], abs=1e-5), 'one place for all'


def test_what_is_seen_in_every_trial_is_not_taken_for_the_gaze_target(learner):
    """With the likelihood alone it was, in one trial of seven: it explains all faces."""
    rng = np.random.default_rng(0)
    lamp = LOOK + np.array([0.3, -0.2])

    def beside_a_lamp() -> Trial:
        trial, _ = made_trial(rng)
        seen = np.concatenate([trial.candidates, [lamp]])
        return dataclasses.replace(trial, candidates=seen, seen_before_shift=len(seen))

    for _ in range(100):
        learner.update(beside_a_lamp())
    mistaken = 0
    for _ in range(100):
        trial = beside_a_lamp()
        aim = LOOK + learner.propose(trial.look, LOOK, trial.candidates)
        mistaken += np.allclose(aim, lamp)
    assert mistaken < 5
    assert learner.log_evidence > 20


def test_it_learns_which_object_is_attended_without_labels(learner):
    rng = np.random.default_rng(0)
    before = share_right(learner, rng)
    for _ in range(100):
        learner.update(made_trial(rng)[0])
    assert before < 0.5
    assert share_right(learner, rng) > 0.85
    assert learner.log_evidence > 20


def test_faces_that_tell_nothing_give_no_evidence(learner):
    rng = np.random.default_rng(6)
    highest = 0.0
    for _ in range(70):
        trial, _ = made_trial(rng)
        other, _ = made_trial(rng)
        learner.update(dataclasses.replace(trial, face=other.face))
        highest = max(highest, learner.log_evidence)
    assert learner.trials == 70
    assert highest < np.log(20)


def test_when_the_world_is_mirrored_it_learns_again(learner):
    rng = np.random.default_rng(8)

    def learn(trials, mirrored):
        for _ in range(trials):
            trial, _ = made_trial(rng)
            face = trial.face[:, ::-1] if mirrored else trial.face
            learner.update(dataclasses.replace(trial, face=np.ascontiguousarray(face)))

    learn(60, mirrored=False)
    knew = learner.log_evidence
    learn(30, mirrored=True)
    assert learner.log_evidence < knew / 2, 'what it knew is wrong now, and it says so'
    learn(70, mirrored=True)
    assert learner.log_evidence > 20
    assert len(learner.state()['faces']) < 120, 'the trials before the change are forgotten'


def test_a_snapshot_stays_as_it_was_while_the_learner_goes_on(learner):
    rng = np.random.default_rng(7)
    face, places = drawn_face(np.array([0.3, 0.1])), LOOK + rng.uniform(-0.5, 0.5, (4, 2))
    snapshot = learner.snapshot()
    before = snapshot.log_density(standardised(face)[None], LOOK, places)
    assert np.array_equal(
        before, learner.snapshot().log_density(standardised(face)[None], LOOK, places)
    )
    for _ in range(20):
        learner.update(made_trial(rng)[0])
    assert np.array_equal(before, snapshot.log_density(standardised(face)[None], LOOK, places))
    assert not np.allclose(
        before, learner.snapshot().log_density(standardised(face)[None], LOOK, places)
    )


def test_without_top_down_attention_the_best_guess_is_proposed_whatever_stands_there():
    both = [GazeLineLearner(GazeLineConfig(members=2, top_down=on), 5) for on in (False, True)]
    face = drawn_face(np.array([0.3, 0.1]))
    guess = both[0].propose(Look(face, LOOK), LOOK, np.empty((0, 2)))
    near = [LOOK + guess + 0.01]
    assert both[0].propose(Look(face, LOOK), LOOK, near) == pytest.approx(guess)
    assert both[1].propose(Look(face, LOOK), LOOK, near) == pytest.approx(guess + 0.01)


def test_what_was_fixated_changes_nothing():
    """It does not use the fixation: all that was seen counts alike."""
    learners = [
        GazeLineLearner(GazeLineConfig(members=3, channels=4, first_guess='none'), seed=1)
        for _ in range(2)
    ]
    rng = np.random.default_rng(1)
    for _ in range(5):
        trial, attended = made_trial(rng)
        for learner, fixated in zip(learners, (attended, (attended + 1) % 4), strict=True):
            fixation = trial.candidates[fixated]
            learner.update(dataclasses.replace(trial, fixation=fixation, seen_before_shift=0))
    one, other = (learner.state() for learner in learners)
    assert all(np.array_equal(one[name], other[name]) for name in one)


def test_a_plausible_object_is_proposed_exactly_else_the_best_guess(learner):
    face = drawn_face(np.zeros(2))
    guess = learner.propose(Look(face, LOOK), LOOK, np.empty((0, 2)))
    near, far = LOOK + guess + 0.01, LOOK + guess + 2.0
    here = LOOK + 0.2
    assert learner.propose(Look(face, LOOK), here, [near, far]) == pytest.approx(near - here)
    assert learner.propose(Look(face, LOOK), here, [far]) == pytest.approx(LOOK + guess - here)


def test_a_trial_in_which_nothing_was_seen_changes_nothing(learner):
    before = learner.state()
    learner.update(Trial(drawn_face(np.zeros(2)), LOOK, LOOK[None], LOOK))
    after = learner.state()
    assert learner.trials == 1
    assert all(np.array_equal(before[k], after[k]) for k in before if k != 'trials')


def test_a_restored_learner_goes_on_bit_for_bit(learner):
    rng = np.random.default_rng(2)
    # After fifteen trials it weighs, too.
    for _ in range(20):
        learner.update(made_trial(rng)[0])
    again = GazeLineLearner(GazeLineConfig(members=3, channels=4, first_guess='none'), seed=99)
    again.restore(learner.state())
    for _ in range(3):
        trial, _ = made_trial(rng)
        learner.update(trial)
        again.update(trial)
    one, other = learner.state(), again.state()
    assert one.keys() == other.keys()
    assert all(np.array_equal(one[name], other[name]) for name in one)


@pytest.mark.parametrize(
    ('spoil', 'why'),
    [
        (lambda s: s.pop('faces'), 'faces'),
        (
            lambda s: s.update({'network.coder.0.weight': np.zeros((1, 1))}),
            'must be float32 of shape',
        ),
        (
            lambda s: s.update({'mean.stretch_logits': np.full((3, 9), np.nan, np.float32)}),
            'must hold numbers',
        ),
        (lambda s: s.update({'candidate_counts': np.array([7])}), 'candidates must be'),
        (lambda s: s.update({'evidence.nats': np.zeros(9)}), 'evidence'),
    ],
)
def test_another_learners_state_is_refused_and_changes_nothing(learner, spoil, why):
    rng = np.random.default_rng(4)
    learner.update(made_trial(rng)[0])
    before, spoilt = learner.state(), learner.state()
    spoil(spoilt)
    with pytest.raises(ValueError, match=why):
        learner.restore(spoilt)
    after = learner.state()
    assert all(np.array_equal(before[name], after[name]) for name in before)


@pytest.mark.parametrize('kind', ['paper', 'gaze_line'])
def test_learners_are_chosen_by_name(kind):
    made = make_learner(kind, seed=0)
    assert made.kind == kind
    face = drawn_face(np.zeros(2))
    assert made.propose(Look(face, LOOK), LOOK, np.empty((0, 2))).shape == (2,)
