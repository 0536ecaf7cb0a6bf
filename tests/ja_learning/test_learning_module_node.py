"""`learning_module`: proposes while a trial is under way, learns once a fixation, remembers."""

import os
from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import ConfigError
from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import encode_detections
from ja_common.image_codec import encode_image
from ja_common.point_cloud_codec import decode_columns
from ja_common.topics import (
    BELIEF,
    DETECTIONS,
    EVIDENCE,
    FACE_IMAGE,
    FIXATION,
    GLANCE_DELTA,
    INTERRUPTED,
    JOINT_STATES,
    LM_DELTA,
)
from ja_learning.core.checkpoint import load_checkpoint
from ja_learning.core.network import ThreeLayerNetwork
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.trial import Trial
from ja_learning.core.trial_pipeline import BELIEF_SAMPLES
from ja_learning.learning_module_node import LearningModuleNode
from node_bench import header, joint_state

MS = 1_000_000
ATTENDED = Detection(Kind.FACE, 0.0, 0.0, 0, 0, 40, 48, 1.0, attended=True)
BALL = Detection(Kind.OBJECT, -0.2, 0.1, 0, 0, 10, 10, 1.0)
PASSING = Detection(Kind.FACE, 0.1, 0.0, 0, 0, 40, 48, 1.0)
FACE = np.random.default_rng(0).integers(0, 256, (30, 25)).astype(np.uint8)
PUBLISHED = [DETECTIONS, FACE_IMAGE, FIXATION, INTERRUPTED, JOINT_STATES]


class NodeTrials:
    """Sends the node the images of trials, one after the other; the node answers each."""

    def __init__(self, bench):
        self.bench = bench
        self.ms = 0

    def send_look(self, face=FACE, pan=0.0):
        stamp_ns = self._tick(pan)
        self.bench.publish(FACE_IMAGE, encode_image(face, header(stamp_ns).stamp, 'eye'))
        return self._send_image(stamp_ns, [ATTENDED])

    def send_rest(self, pan, detections=()):
        return self._send_image(self._tick(pan), list(detections))

    def send_motion(self, pan):
        return self._send_image(self._tick(pan, velocity=[0.5, 0.0]), [])

    def send_fixation(self, pan, direction):
        """End the trial, and wait until it is learned."""
        self._send_image(self._tick(pan), [], direction)
        while self.bench.node.health.values['of these still waiting'] != '0':
            self.send_rest(pan)

    def send_trial(self, direction=(0.4, 0.1)):
        """Send a whole trial: look, one shift, fixation."""
        self.send_look()
        before = self.learned
        self.send_fixation(0.3, direction)
        assert self.learned == before + 1

    def send_interruption(self):
        before = self.bench.received(INTERRUPTED)
        self.bench.publish(INTERRUPTED, header(self.ms * MS, ''))
        self.bench.wait(lambda: self.bench.received(INTERRUPTED) > before)

    @property
    def learned(self):
        return int(self.bench.node.health.values.get('trials learned', '0'))

    def _tick(self, pan, **more):
        self.ms += 100
        self.bench.publish_posture(self.ms * MS, pan, **more)
        return self.ms * MS

    def _send_image(self, stamp_ns, detections, fixation=()):
        self.bench.publish(DETECTIONS, encode_detections(header(stamp_ns), detections))
        answer = self.bench.next(LM_DELTA)
        assert answer.header == header(stamp_ns, '')
        self._publish_fixation(stamp_ns, fixation)
        return answer

    def _publish_fixation(self, stamp_ns, direction):
        before = self.bench.received(FIXATION)
        self.bench.publish(FIXATION, joint_state(stamp_ns, *direction))
        self.bench.wait(lambda: self.bench.received(FIXATION) > before)


@pytest.fixture
def make_trials(make_bench):
    def make(**parameters):
        subscribes = [LM_DELTA, GLANCE_DELTA, EVIDENCE]
        return NodeTrials(make_bench(LearningModuleNode, PUBLISHED, subscribes, **parameters))

    return make


@pytest.fixture
def trials(make_trials):
    return make_trials()


def test_proposal_is_the_networks_at_the_posture_of_every_image_of_a_trial(trials):
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    assert list(trials.send_look().position) == pytest.approx(network.predict(FACE, (0, 0)))
    assert list(trials.send_rest(0.3).position) == pytest.approx(network.predict(FACE, (0.3, 0)))


def test_nothing_is_proposed_before_a_look_and_after_the_fixation(trials):
    assert not trials.send_rest(0.0).name
    assert not trials.send_rest(0.0, [PASSING]).name, 'a face that is not attended is no look'
    trials.send_trial()
    assert not trials.send_rest(0.3).name


def test_face_image_may_come_after_its_detections(trials):
    stamp_ns = trials._tick(0.0)
    trials.bench.publish(DETECTIONS, encode_detections(header(stamp_ns), [ATTENDED]))
    trials.bench.publish(FACE_IMAGE, encode_image(FACE, header(stamp_ns).stamp, 'eye'))
    assert trials.bench.next(LM_DELTA).name


def test_a_fixation_ends_the_trial_which_is_learned_once(trials):
    trials.send_look()
    before = list(trials.send_rest(0.0).position)
    trials.send_look()
    trials.send_fixation(0.3, (0.4, 0.1))
    trials.send_fixation(0.3, (0.4, 0.1))
    assert trials.learned == 1
    assert list(trials.send_look().position) != before
    trials.send_fixation(0.0, (0.4, 0.1))  # still where the look was: nothing was shifted
    assert trials.learned == 1


def test_postures_at_rest_are_learned_and_those_passed_on_the_way_are_not(trials):
    trials.send_look()
    trials.send_motion(0.1)
    trials.send_rest(0.2)
    trials.send_motion(0.25)
    trials.send_fixation(0.3, (0.4, 0.1))
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    network.update(
        Trial(FACE, np.zeros(2), np.array([(0.0, 0.0), (0.2, 0.0)]), np.array((0.4, 0.1)))
    )
    assert list(trials.send_look().position) == pytest.approx(
        network.predict(FACE, (0, 0)), abs=1e-7
    )


def test_a_trial_that_the_gate_has_interrupted_is_not_learned(trials):
    trials.send_look()
    trials.send_interruption()
    trials.send_fixation(0.3, (0.4, 0.1))
    trials.send_look()
    assert trials.learned == 0, 'neither as fixated nor as given up'
    trials.send_look()
    trials.send_fixation(0.3, (0.4, 0.1))
    assert trials.learned == 1


def test_learning_moves_the_proposal_towards_the_fixation(make_trials):
    trials = make_trials(learning_rate=0.01)
    target = np.array([0.4, 0.1])

    def distance():
        return np.linalg.norm(np.subtract(trials.send_look().position, target))

    before = distance()
    for _ in range(10):
        trials.send_trial(target)
    assert distance() < 0.8 * before


def test_in_lockstep_it_answers_with_what_it_knew_a_trial_ago(make_trials):
    trials = make_trials(lockstep=True)
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    for _ in range(3):
        assert list(trials.send_look().position) == pytest.approx(network.predict(FACE, (0, 0)))
        trials.send_fixation(0.3, (0.4, 0.1))
        if trials.learned > 1:
            network.update(Trial(FACE, np.zeros(2), np.array([(0.0, 0.0)]), np.array((0.4, 0.1))))


def test_every_trial_that_is_learned_is_reported_with_its_stamp(make_bench):
    updates = []

    def on_update(trial, stamp_ns):
        updates.append((trial.fixation is None, stamp_ns // MS))

    make_node = partial(LearningModuleNode, on_update=on_update)
    trials = NodeTrials(make_bench(make_node, PUBLISHED, [LM_DELTA]))
    trials.send_trial()
    ended_ms = trials.ms
    trials.send_look()
    trials.send_rest(0.3)
    trials.send_look()
    assert updates[1] == (True, trials.ms), 'given up'
    assert updates[0][0] is False
    assert updates[0][1] <= ended_ms
    trials.bench.call(SetBool, 'learning_enabled', data=False)
    trials.send_fixation(0.3, (0.4, 0.1))
    assert len(updates) == 2


def test_disabled_learning_still_proposes(trials):
    assert trials.bench.call(SetBool, 'learning_enabled', data=False).success
    before = list(trials.send_look().position)
    trials.send_fixation(0.3, (0.4, 0.1))
    assert list(trials.send_look().position) == before
    assert trials.learned == 0
    trials.bench.call(SetBool, 'learning_enabled', data=True)
    trials.send_trial()


def test_reset_forgets_everything(trials):
    untrained = list(trials.send_look().position)
    trials.send_trial()
    assert list(trials.send_look().position) != untrained
    assert trials.bench.call(Trigger, 'reset_learning').success
    assert not trials.send_rest(0.0).name, 'the trial under way too'
    assert list(trials.send_look().position) == untrained


def test_the_next_process_continues_with_what_was_learned(make_trials, tmp_path):
    kept = {'checkpoint_folder': str(tmp_path / 'a folder')}
    first = make_trials(**kept)
    first.send_trial()
    learned = list(first.send_look().position)
    first.bench.close()
    [path] = (tmp_path / 'a folder').glob('paper-*.npz')

    second = make_trials(**kept, seed=5)
    assert second.learned == 1
    assert list(second.send_look().position) == learned
    second.bench.close()
    assert [path] == list(path.parent.glob('paper-*.npz')), 'nothing new was learned'

    third = make_trials(**kept, seed=5, resume=False)
    assert third.learned == 0
    assert list(third.send_look().position) != learned


def test_heads_side_by_side_keep_what_they_learned_apart(ros_context, tmp_path):
    place = Parameter('checkpoint_folder', value=str(tmp_path))
    heads = [
        LearningModuleNode(context=ros_context, namespace=name, parameter_overrides=[place])
        for name in ('left', 'right')
    ]
    for head in heads:
        head.destroy_node()
    assert sorted(path.name for path in tmp_path.iterdir()) == ['left', 'right']


def test_a_learner_is_saved_and_loaded_on_demand(make_trials, tmp_path):
    trials = make_trials(checkpoint_folder=str(tmp_path))
    nothing = trials.bench.call(Trigger, 'load_checkpoint')
    assert not nothing.success
    assert nothing.message == f'no checkpoint in {tmp_path}'
    trials.send_trial()
    path = tmp_path / 'paper-000001.npz'
    assert trials.bench.call(Trigger, 'save_checkpoint').message == f'1 trials saved to {path}'
    learned = list(trials.send_look().position)
    trials.send_rest(0.0)
    trials.send_trial()
    assert list(trials.send_look().position) != learned
    assert trials.bench.call(Trigger, 'load_checkpoint').message == f'1 trials loaded from {path}'
    assert list(trials.send_look().position) == learned


def test_it_is_saved_every_so_many_trials(make_trials, tmp_path):
    trials = make_trials(checkpoint_folder=str(tmp_path), checkpoint_every_trials=2)
    for expected in ([], [1], [1], [1, 2]):
        trials.send_trial()
        saved = sorted(tmp_path.glob('paper-*.npz'))
        assert saved == [tmp_path / f'paper-{number:06d}.npz' for number in expected]


def test_what_is_forgotten_stays_forgotten(make_trials, tmp_path):
    first = make_trials(checkpoint_folder=str(tmp_path), checkpoint_every_trials=1)
    untrained = list(first.send_look().position)
    first.send_trial()
    assert first.bench.call(Trigger, 'reset_learning').success
    first.bench.close()
    second = make_trials(checkpoint_folder=str(tmp_path), seed=5)
    assert list(second.send_look().position) == untrained


def test_what_was_forgotten_comes_back_on_demand(make_trials, tmp_path):
    first = make_trials(checkpoint_folder=str(tmp_path), checkpoint_every_trials=0)
    first.send_trial()
    learned = list(first.send_look().position)  # and saved by nothing yet
    first.send_rest(0.0)
    assert first.bench.call(Trigger, 'reset_learning').success
    assert list(first.send_look().position) != learned
    first.send_rest(0.0)
    assert first.bench.call(Trigger, 'load_checkpoint').message.startswith('1 trials loaded from')
    assert list(first.send_look().position) == learned
    first.bench.close()
    second = make_trials(checkpoint_folder=str(tmp_path), seed=5)
    assert list(second.send_look().position) == learned, 'after a restart, too'


def test_a_damaged_checkpoint_is_reported_and_the_one_before_it_is_used(make_trials, tmp_path):
    first = make_trials(checkpoint_folder=str(tmp_path), checkpoint_every_trials=1)
    first.send_trial()
    first.send_trial()
    first.bench.close()
    newest = tmp_path / 'paper-000002.npz'
    newest.write_bytes(newest.read_bytes()[:-100])
    second = make_trials(checkpoint_folder=str(tmp_path))
    assert second.learned == 1
    assert f'refused: {newest} is not a checkpoint' in second.bench.complaint()
    second.send_trial()


def test_no_untrained_learner_starts_where_only_others_have_learned(make_trials, tmp_path):
    first = make_trials(checkpoint_folder=str(tmp_path), hidden=3)
    first.send_trial()
    first.bench.close()
    with pytest.raises(ConfigError, match='was made with hidden = 3, here it is 7'):
        make_trials(checkpoint_folder=str(tmp_path))


def test_without_a_place_saving_and_loading_say_so(trials):
    for service in ('save_checkpoint', 'load_checkpoint'):
        response = trials.bench.call(Trigger, service)
        assert not response.success
        assert 'checkpoint_folder is empty' in response.message


@pytest.fixture
def full_disk(monkeypatch):
    """Return a context in which nothing can be written."""

    @contextmanager
    def full():
        def refuse(*_args, **_kwargs):
            raise OSError(28, 'No space left on device')

        with monkeypatch.context() as broken:
            broken.setattr(np, 'savez', refuse)
            yield

    return full


def test_a_checkpoint_that_cannot_be_written_is_reported_and_learning_goes_on(
    make_trials, tmp_path, full_disk
):
    trials = make_trials(checkpoint_folder=str(tmp_path), checkpoint_every_trials=1)
    with full_disk():
        trials.send_trial()
        assert trials.send_look().name  # it answers
        trials.bench.wait_for_complaint('cannot be written (No space left on device): make room')
        trials.send_trial()
    # No trial comes after the disk has room again: the clock saves what was learned.
    trials.bench.wait(lambda: list(tmp_path.glob('paper-*.npz')))
    [path] = tmp_path.glob('paper-*.npz')
    assert load_checkpoint(path)[1]['trials'] == 2
    trials.bench.wait(lambda: 'cannot be written' not in trials.bench.complaint())


def test_a_folder_that_vanished_is_an_error_until_it_can_be_made_again(make_trials, tmp_path):
    kept = tmp_path / 'kept'
    trials = make_trials(checkpoint_folder=str(kept), checkpoint_every_trials=1)
    kept.rename(tmp_path / 'away')
    kept.write_text('a file in the place of the folder')
    trials.send_trial()
    for _ in range(2):  # again and again, with no further trial
        trials.bench.wait_for_complaint('kept is no folder): remove that, or name another place')
        trials.bench.node.health.clear_problem('saving')
    assert trials.send_look().name
    kept.unlink()
    trials.bench.wait(lambda: list(kept.glob('paper-*.npz')))


def test_what_cannot_be_forgotten_for_good_is_reported(make_trials, tmp_path, full_disk):
    trials = make_trials(checkpoint_folder=str(tmp_path))
    with full_disk():
        assert trials.bench.set_parameter('learner', 'gaze_line').successful
        assert 'a restart would bring back what was forgotten' in trials.bench.complaint()
    assert trials.send_look().name


@pytest.mark.parametrize(
    ('spoil', 'text'),
    [
        ({'encoding': 'magic8'}, 'magic8'),
        ({'width': 20, 'step': 20}, '30 rows x 25 columns'),
        ({'data': b''}, '0 bytes of data'),
    ],
)
def test_broken_face_image_is_one_clear_error_and_the_node_goes_on(trials, spoil, text):
    stamp_ns = trials._tick(0.0)
    message = encode_image(FACE, header(stamp_ns).stamp, 'eye')
    for name, value in spoil.items():
        setattr(message, name, value)
    trials.bench.publish(DETECTIONS, encode_detections(header(stamp_ns), [ATTENDED]))
    trials.bench.publish(FACE_IMAGE, message)
    trials.bench.wait_for_complaint(text)
    assert '/face_image: ' in trials.bench.complaint()
    trials.send_trial()


def test_broken_fixation_is_one_clear_error_and_the_node_goes_on(trials):
    trials.send_look()
    trials.bench.publish(FIXATION, joint_state(trials.ms * MS, float('nan'), 0.0))
    trials.bench.wait_for_complaint('/fixation: position of')
    trials.send_trial()


def test_another_learner_may_be_chosen_while_the_node_runs(make_bench):
    bench = make_bench(LearningModuleNode, publishes=PUBLISHED, subscribes=[LM_DELTA])
    trials = NodeTrials(bench)
    trials.send_trial()
    assert bench.set_parameter('learner', 'gaze_line').successful
    trials.send_look()
    delta = trials.send_rest(0.0, [BALL])
    assert delta.name
    refused = bench.set_parameter('learner', 'teacher')
    assert not refused.successful
    assert "'teacher' is not one of paper, gaze_line" in refused.reason


@pytest.mark.parametrize('learner', ['paper', 'gaze_line'])
def test_the_belief_is_published_to_its_subscribers(make_bench, learner):
    bench = make_bench(LearningModuleNode, PUBLISHED, [LM_DELTA, BELIEF], learner=learner)
    trials = NodeTrials(bench)
    trials.send_rest(0.0)
    trials.send_look(pan=0.1)
    bench.wait(lambda: len(bench.messages(BELIEF)) == 2)
    before, looking = bench.messages(BELIEF)
    assert before.width == 0, 'no trial is under way'
    published = decode_columns(looking, ('pan', 'tilt', 'weight'))
    assert len(published['pan']) == BELIEF_SAMPLES
    assert published['weight'].sum() == pytest.approx(1.0, abs=1e-5)
    assert np.mean(published['pan']) == pytest.approx(0.1, abs=0.1), 'untrained, about her'


def test_glances_are_asked_for_until_both_sides_were_seen(make_trials):
    trials = make_trials(learner='gaze_line', look_around='both_sides', glance_pan_rad=0.4)

    def glance_at(pan):
        if pan is None:
            trials.send_look()
        else:
            trials.send_rest(pan)
        trials.bench.wait(lambda: len(trials.bench.messages(GLANCE_DELTA)) == trials.ms // 100)
        return list(trials.bench.messages(GLANCE_DELTA)[-1].position)

    assert glance_at(None) == pytest.approx([0.4, 0.0])
    assert glance_at(0.4) == pytest.approx([-0.8, 0.0])
    assert glance_at(-0.4) == [], 'nothing more to see'
    assert glance_at(0.1) == [], 'and none after the shift'


def test_evidence_is_published_with_every_image(make_trials):
    trials = make_trials(learner='gaze_line')
    trials.send_look()
    trials.send_rest(0.2)
    trials.bench.wait(lambda: len(trials.bench.messages(EVIDENCE)) == 2)
    stamps = [message.header for message in trials.bench.messages(EVIDENCE)]
    assert stamps == [header(100 * MS), header(200 * MS)]
    for message in trials.bench.messages(EVIDENCE):
        columns = decode_columns(message, ['log_evidence', 'expected_gain'])
        assert columns['log_evidence'] == 0.0, 'nothing is known yet'
        assert np.isnan(columns['expected_gain']), 'and it does not know what it can'


def test_a_trial_that_was_given_up_is_learned_by_a_learner_that_needs_no_fixation(make_trials):
    trials = make_trials(learner='gaze_line')
    trials.send_look()
    trials.send_rest(0.3, [BALL])
    trials.send_look()
    trials.bench.wait(lambda: trials.learned == 1)


def test_without_the_right_to_a_realtime_priority_it_says_so_and_answers(make_trials, monkeypatch):
    def refuse(*_):
        raise PermissionError(1, 'Operation not permitted')

    monkeypatch.setattr(os, 'sched_setscheduler', refuse)
    trials = make_trials(realtime_priority=5)
    granted = trials.bench.node.health.values['real-time priority']
    assert granted.startswith('none: real-time priority 5 is not allowed to this user: be root')
    assert trials.send_look().name
