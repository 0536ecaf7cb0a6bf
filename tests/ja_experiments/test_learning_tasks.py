"""The tasks of the benchmark: what an entrant sees, how it is scored, what it must not see."""

import json
import subprocess
import sys
from copy import deepcopy
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from scipy.stats import chisquare, ks_2samp

from ja_common.core.config import ConfigError
from ja_experiments.datasets.looks import Looks
from ja_experiments.learning_tasks import baselines
from ja_experiments.learning_tasks.baselines import BASELINES, find_entrant
from ja_experiments.learning_tasks.drawn_trials import TrialSource, nearest_object, towards
from ja_experiments.learning_tasks.entrant import EntryTrack, load_entrant
from ja_experiments.learning_tasks.ppo_entrant import LIBRARY
from ja_experiments.learning_tasks.score_report import read_seeds, score_tables, write_scores
from ja_experiments.learning_tasks.scoring import EntrantScore, first_reached, score, score_rows
from ja_experiments.learning_tasks.stage_looks import mirrored, other_caregiver, stage_looks
from ja_experiments.learning_tasks.task_table import TASKS, find_task
from ja_experiments.learning_tasks.trial_env import TrialEnv
from ja_learning.core.track import TRACKS, Track
from synthetic_trials import synthetic_looks

ALL_SENSES = Track.parse('landmarks with depth')
TABULAR = 'ja_experiments.learning_tasks.tabular_entrant:TabularEntrant'


def made_up_looks(scene: str, caregiver: int, count: int) -> Looks:
    """Return looks at a face whose bright spot moves as her gaze does, and noise as landmarks."""
    faces, postures, directions = (
        np.resize(column, (count, *column.shape[1:])) for column in synthetic_looks()
    )
    rng = np.random.default_rng([caregiver, len(scene)])
    gazes = rng.normal(0.0, 0.1, (count, 9))
    gazes[::4] = np.nan
    gazes[1::4, 4:6] = np.nan
    return Looks(
        np.roll(faces, caregiver, axis=0), postures, postures, np.roll(directions, caregiver, 0),
        gazes, face_distances=np.ones(count), object_distances=rng.uniform(0.6, 1.0, count),
    )  # fmt: skip


@pytest.fixture
def quick_tests(monkeypatch):
    """Test on fewer looks."""
    monkeypatch.setattr('ja_experiments.learning_tasks.stage_looks.TEST_LOOKS', 25)


@pytest.fixture
def five_objects():
    return TrialSource(find_task('five-objects'), ALL_SENSES)


@pytest.mark.parametrize('track', [str(track) for track in TRACKS])
@pytest.mark.parametrize('task', TASKS)
def test_gymnasium_accepts_every_task(task, track):
    env = gymnasium.make(
        f'ja_experiments.learning_tasks.trial_env:{TASKS[task].environment}',
        track=track,
        source=made_up_looks,
    )
    check_env(env.unwrapped)
    observation, _ = env.reset(seed=1)
    assert all(np.isfinite(values).all() for values in observation.values())
    assert ('ranges' in observation) == ('depth' in track)
    assert ('gaze' in observation) == ('landmarks' in track)


def test_numbers_that_were_not_read_are_zero_and_marked(five_objects):
    looks = made_up_looks('', 0, 8)
    rng = np.random.default_rng(0)
    trials = [five_objects.draw_trial(rng, looks, i, 1.0).observation for i in range(8)]
    assert not trials[0]['gaze_read'].any()
    np.testing.assert_array_equal(trials[0]['gaze'], 0.0)
    np.testing.assert_array_equal(trials[1]['gaze_read'], [1, 1, 1, 1, 0, 0, 1, 1, 1])
    np.testing.assert_allclose(trials[2]['gaze'], looks.gazes[2], rtol=1e-6)


def test_a_seed_gives_the_same_trials_on_every_track():
    def episodes(track):
        env = TrialEnv('unreliable-caregiver', 0, track, source=made_up_looks)
        env.reset(seed=3)
        for _ in range(20):
            observation, _ = env.reset()
            _, reward, ended, truncated, info = env.step(towards(observation, 1))
            assert ended
            assert not truncated
            yield observation['objects'].tolist(), info, reward

    strict = list(episodes('strict'))
    assert strict == list(episodes('strict'))
    assert strict == list(episodes('landmarks with depth'))
    assert 0 < sum(reward for *_, reward in strict) < 20
    assert not {'attended', 'direction'} & set(strict[0][1])


def test_the_reward_is_for_the_attended_object_alone(five_objects):
    env = TrialEnv('five-objects', 0, source=made_up_looks)
    blind = TrialEnv('five-objects', 0, rewarded=False, source=made_up_looks)
    looks = stage_looks(env.task, 0, made_up_looks)[0].practice
    for seed in range(10):
        env.reset(seed=seed)
        blind.reset(seed=seed)
        action = (looks.directions[0] - looks.postures[0]).astype(np.float32)
        assert env.step(action)[1] == 1.0
        assert blind.step(action)[1] == 0.0
    with pytest.raises(RuntimeError, match='reset'):
        env.step(action)


def test_swapping_the_attended_object_changes_no_observation(five_objects):
    """The same objects in all orders, whichever of them is attended: the same observations."""
    source = TrialSource(replace(find_task('five-objects'), objects=3), Track())
    looks = made_up_looks('', 0, 1)
    rng = np.random.default_rng(0)
    [trial] = [source.draw_trial(rng, looks, 0, 1.0)]
    places = trial.observation['objects'].astype(float)
    orders = set(permutations(map(tuple, trial.observation['objects'].tolist())))
    for attended in range(3):
        others = np.roll(places, -attended, axis=0)
        seen = {
            tuple(map(tuple, observation['objects'].tolist()))
            for observation in observed(source, looks, others)
        }
        assert seen == orders


def observed(source, looks, places):
    """Yield observations of a look at the first of the places, with the others beside it."""
    here = replace(looks, directions=places[:1])
    with pytest.MonkeyPatch.context() as patch:
        setting = SimpleNamespace(directions=places, features=np.zeros((3, 3)))
        patch.setattr(
            'ja_experiments.learning_tasks.drawn_trials.SimulatedTask',
            lambda *_: SimpleNamespace(draw_setting=lambda rng: setting),
        )
        for seed in range(60):
            trial = source.draw_trial(np.random.default_rng(seed), here, 0, 1.0)
            attended = trial.observation['objects'][trial.attended]
            np.testing.assert_allclose(attended, places[0], rtol=1e-6)
            yield trial.observation


def test_nothing_but_her_face_tells_the_attended_object(five_objects):
    """Order, place, salience and range of the attended object are those of any object."""
    looks = made_up_looks('', 0, 125)
    rng = np.random.default_rng(0)
    trials = [five_objects.draw_trial(rng, looks, i % 125, 1.0) for i in range(1000)]
    attended = np.array([trial.attended for trial in trials])
    assert chisquare(np.bincount(attended, minlength=5)).pvalue > 1e-3
    salient = [int(np.argmax(trial.observation['salience'])) for trial in trials]
    assert np.mean(attended == salient) == pytest.approx(0.2, abs=0.04)
    is_attended = attended[:, None] == np.arange(5)
    for name, column in [('salience', None), ('ranges', 0), ('ranges', 1), ('objects', 1)]:
        values = np.array([trial.observation[name] for trial in trials])
        values = values if column is None else values[..., column]
        # 125 looks alone are the sample of the attended object's place.
        some = is_attended[:125]
        assert ks_2samp(values[:125][some], values[:125][~some]).pvalue > 1e-3, name


def test_an_unreliable_caregiver_attends_to_no_object_in_some_trials(five_objects):
    looks, rng = made_up_looks('', 0, 1), np.random.default_rng(0)
    trials = [five_objects.draw_trial(rng, looks, 0, reliability=0.7) for _ in range(300)]
    assert np.mean([trial.attended is None for trial in trials]) == pytest.approx(0.3, abs=0.08)


def test_no_look_of_a_test_is_one_of_practice():
    def numbered(scene, caregiver, count):
        looks = made_up_looks(scene, caregiver, count)
        faces = np.zeros_like(looks.faces)
        faces[:, 0, 0], faces[:, 0, 1] = np.arange(count) // 200, np.arange(count) % 200
        return replace(looks, faces=faces)

    for task in TASKS.values():
        stages = stage_looks(task, 0, numbered)
        assert len(stages) == len(task.stages)
        for stage, marks in zip(stages, task.stages, strict=True):
            practised, tested = (
                {face.tobytes() for face in looks.faces} for looks in (stage.practice, stage.test)
            )
            assert not practised & tested
            assert len(practised) >= marks[-1]


def test_the_change_of_a_task_is_what_its_name_says():
    first, after = stage_looks(find_task('mirrored-camera'), 0, made_up_looks)
    np.testing.assert_array_equal(after.test.faces, first.test.faces[:, :, ::-1])
    np.testing.assert_array_equal(after.test.directions, first.test.directions)
    np.testing.assert_allclose(mirrored(after.test).gazes, first.test.gazes)
    asked = []
    for name in ('new-caregiver', 'new-room'):
        stage_looks(
            find_task(name), 4, lambda *order: asked.append(order) or made_up_looks(*order)
        )
    assert [order[:2] for order in asked] == [
        ('default', 4), ('default', 5), ('default', 4), ('bare_room', 4)
    ]  # fmt: skip
    assert [other_caregiver(seed) for seed in (0, 1, 10, 11)] == [1, 0, 11, 10]


def test_the_change_comes_after_the_trials_of_the_first_stage():
    env = TrialEnv('new-room', 0, source=made_up_looks)
    env.reset(seed=0)
    first, after = stage_looks(env.task, 0, made_up_looks)
    for trial in range(102):
        observation, info = env.reset()
        assert info['trial'] == trial
        looks = first.practice if trial < 100 else after.practice
        np.testing.assert_array_equal(observation['face'], looks.faces[trial % 100])
        env.step(np.zeros(2, np.float32))


class Counting:
    """An entrant that knows nothing, and writes down what is asked of it."""

    track = 'strict'
    log: list = []  # noqa: RUF012

    def __init__(self, seed):
        self.log.append(seed)
        self.learned = 0

    def propose(self, observation):
        assert set(observation) == {'face', 'face_direction', 'posture', 'objects', 'salience'}
        self.learned = -1000  # a test asks a copy
        return np.zeros(2)

    def learn(self, observation, fixated):
        assert fixated == np.argmax(observation['salience'])
        self.learned += 1
        self.log.append(self.learned)


class Acting(Counting):
    """An entrant that chooses its actions, on the reward if it declares so."""

    track = 'rewarded'
    surplus = 0

    def practise(self, env, trials):
        total = 0.0
        for _ in range(trials + self.surplus):
            observation, _ = env.reset()
            total += env.step(towards(observation, 0))[1]
        self.log.append(total > 0)


def test_an_entrant_practises_and_is_tested_without_learning(quick_tests, monkeypatch):
    monkeypatch.setitem(BASELINES, 'counting', Counting)
    monkeypatch.setattr(Counting, 'log', [])
    found = score('counting', 'new-caregiver', 2, made_up_looks)
    assert Counting.log == [2, *range(1, 151)]
    assert found.track == 'strict'
    assert [len(stage) for stage in found.success] == [2, 4]
    assert found.success[0][0] == found.success[0][1]


@pytest.mark.parametrize(('track', 'paid'), [('rewarded', True), ('strict', False)])
def test_only_an_entrant_that_declares_it_receives_the_reward(
    track, paid, quick_tests, monkeypatch
):
    monkeypatch.setitem(BASELINES, 'acting', Acting)
    monkeypatch.setattr(Counting, 'log', [])
    monkeypatch.setattr(Acting, 'track', track)
    score('acting', 'new-room', 0, made_up_looks)
    assert Counting.log == [0, *[paid] * 4]


def test_an_entrant_that_practises_more_than_the_task_states_is_refused(quick_tests, monkeypatch):
    monkeypatch.setitem(BASELINES, 'acting', Acting)
    monkeypatch.setattr(Acting, 'surplus', 1)
    with pytest.raises(ConfigError, match='practised for 101 trials in place of 100'):
        score('acting', 'new-room', 0, made_up_looks)


@pytest.mark.parametrize('name', ['chance', 'most-salient', 'tabular'])
def test_a_baseline_is_scored_the_same_twice(name, quick_tests):
    first = score(name, 'mirrored-camera', 0, made_up_looks)
    assert first == score(name, 'mirrored-camera', 0, made_up_looks)
    assert first.track == 'strict'
    if name != 'tabular':
        assert np.array(first.success[1]) == pytest.approx(0.2, abs=0.1)


def test_the_table_learns_from_counts_alone(quick_tests):
    success = score('tabular', 'five-objects', 0, made_up_looks).success[0]
    assert success[0] < 0.35
    assert success[-1] > 0.45


@pytest.mark.parametrize(
    ('name', 'track'),
    [
        ('paper', 'strict'),
        ('fast', 'strict'),
        ('fast-depth', 'strict with depth'),
        ('fast-landmarks', 'landmarks'),
        ('fast-landmarks-depth', 'landmarks with depth'),
    ],
)
def test_a_learner_of_the_project_receives_the_whole_trial(name, track, monkeypatch):
    made = []
    learner = SimpleNamespace(update=made.append, snapshot=lambda: learner)
    learner.propose = lambda look, posture, objects, ranges: made.append((look, ranges))

    def make(kind, seed, config=None):
        learner.config = config or BASE_CONFIG[kind]
        return learner

    monkeypatch.setattr(baselines, 'make_learner', make)
    entrant = find_entrant(name)(0)
    assert entrant.track == track
    source = TrialSource(find_task('five-objects'), Track.parse(track))
    looks = made_up_looks('', 0, 3)
    observation, _ = source.draw_trial(np.random.default_rng(0), looks, 2, 1.0)
    entrant.learn(observation, 3)
    [trial] = made
    np.testing.assert_array_equal(trial.face, looks.faces[2])
    np.testing.assert_allclose(trial.fixation, observation['objects'][3])
    assert trial.seen_before_shift == len(trial.candidates) == 5
    assert np.isfinite(trial.ranges).all() == ('depth' in track)
    assert (trial.gaze is not None) == ('landmarks' in track)
    # Without a proposal the head turns to the most salient object.
    aim = deepcopy(entrant).propose(observation)
    assert nearest_object(observation, aim) == np.argmax(observation['salience'])


BASE_CONFIG = {'paper': None, 'gaze_line': SimpleNamespace(face_reader='pixels')}


def test_ppo_names_what_it_needs(monkeypatch):
    monkeypatch.setattr('ja_experiments.learning_tasks.ppo_entrant.LIBRARY', 'no_such_library')
    with pytest.raises(ConfigError, match=r'needs no_such_library: .* requirements/ppo\.lock'):
        find_entrant('ppo')


def test_ppo_practises_on_the_reward():
    pytest.importorskip(LIBRARY)
    entrant = find_entrant('ppo')(0)
    env = TrialEnv('five-objects', 0, source=made_up_looks)
    env.reset(seed=0)
    entrant.practise(env, 500)
    observation, _ = env.reset()
    assert env.trials == 500
    assert env.action_space.contains(entrant.propose(observation).astype(np.float32))


@pytest.mark.parametrize(
    ('text', 'senses'),
    [
        ('strict', 'strict'),
        ('landmarks with depth', 'landmarks with depth'),
        ('rewarded', 'strict'),
        ('rewarded with depth', 'strict with depth'),
        ('pretrained landmarks', 'landmarks'),
    ],
)
def test_a_track_is_read_as_it_is_written(text, senses):
    track = EntryTrack.parse(text)
    assert str(track) == text
    assert str(track.senses) == senses


@pytest.mark.parametrize('text', ['', 'mine', 'rewarded mine', 'strict rewarded'])
def test_another_track_is_refused(text):
    with pytest.raises(ConfigError, match='rewarded or pretrained'):
        EntryTrack.parse(text)


@pytest.mark.parametrize(
    ('name', 'why'),
    [
        ('nothing', 'no baseline'),
        ('no_such_module:A', 'PYTHONPATH'),
        ('json:NoSuchClass', 'no such class'),
        ('json:JSONDecoder', 'no track'),
    ],
)
def test_what_cannot_enter_is_refused_in_a_sentence(name, why):
    with pytest.raises(ConfigError, match=why):
        find_entrant(name)


def test_an_entrant_is_found_by_its_module():
    assert load_entrant(TABULAR)(0).track == 'strict'
    with pytest.raises(ConfigError, match='is not a task'):
        find_task('six-objects')


def test_seeds_are_read():
    assert read_seeds('0-3,7') == [0, 1, 2, 3, 7]
    for text in ('', 'a', '3-1', '1,1'):
        with pytest.raises(ConfigError, match='is no list'):
            read_seeds(text)


def test_trials_to_criterion_are_interpolated_or_not_reached():
    trials = np.array([0, 10, 50, 100])
    assert first_reached(trials, np.array([0.2, 0.6, 1.0, 1.0])) == pytest.approx(30.0)
    assert first_reached(trials, np.array([0.9, 0.6, 1.0, 1.0])) == 0.0
    assert first_reached(trials, np.array([0.2, 0.6, 0.7, 0.79])) is None


def made_up_scores(ends):
    marks = len(find_task('ten-objects').marks)
    return [EntrantScore('strict', 1, [np.linspace(0.1, end, marks).tolist()]) for end in ends]


def test_rows_hold_the_interval_over_seeds(tmp_path: Path):
    fast = list(score_rows('fast', 'ten-objects', made_up_scores([0.88, 0.9, 0.92])))
    slow = list(score_rows('chance', 'ten-objects', made_up_scores([0.1, 0.11, 0.12])))
    last, to_criterion = fast[-2:]
    assert str(last) == '0.900 (0.850-0.950)'
    assert to_criterion.low < to_criterion.value < to_criterion.high
    assert (last.track, last.seeds, to_criterion.quantity) == ('strict', 3, 'trials to .80')
    assert str(slow[-1]) == 'not reached within 300'
    write_scores([*fast, *slow], [0, 1, 2], tmp_path)
    written = json.loads((tmp_path / 'scores.json').read_text())
    assert written['rows'][-1]['value'] is None
    assert 'NaN' not in (tmp_path / 'scores.json').read_text()
    assert len((tmp_path / 'scores.csv').read_text().splitlines()) == 1 + len(fast) + len(slow)
    assert '| chance | strict | 0.100' in (tmp_path / 'scores.md').read_text()
    [table] = score_tables([*fast, *slow])
    assert table.row_count == 2


def test_the_interval_of_trials_has_an_open_end_where_some_seeds_fail():
    rows = list(score_rows('fast', 'ten-objects', made_up_scores([0.6, 0.9, 0.92])))
    assert rows[-1].value is not None
    assert rows[-1].high is None
    assert '>300)' in str(rows[-1])


def test_the_command_refuses_before_the_work(tmp_path):
    command = [sys.executable, '-m', 'ja_bringup', 'score-learner', 'no_such_module:A']
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 2, ended.stderr
    assert 'PYTHONPATH' in ended.stderr + ended.stdout
    assert not list(tmp_path.iterdir())


def test_between_two_marks_no_trials_to_criterion_are_interpolated():
    success = [[0.2, 0.9], [0.7, 0.75, 0.85, 0.9]]
    scores = [EntrantScore('strict', 1, success)] * 2
    rows = list(score_rows('fast', 'new-room', scores))
    assert [row.trials for row in rows if row.quantity != 'success'] == [50]
    assert rows[-1].stage == 'after the change: room'
    first, after = score_tables([*rows, *score_rows('slow', 'new-room', scores)])
    assert first.row_count == after.row_count == 2
    assert [len(table.columns) for table in (first, after)] == [4, 7]
