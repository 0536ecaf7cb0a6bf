"""`learning_module`: proposes while a trial is under way, learns once a fixation, remembers."""

import numpy as np
import pytest
from std_srvs.srv import SetBool, Trigger

from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import encode_detections
from ja_common.image_codec import encode_image
from ja_common.point_cloud_codec import decode_columns
from ja_common.topics import BELIEF, DETECTIONS, FACE_IMAGE, FIXATION, JOINT_STATES, LM_DELTA
from ja_learning.core.network import NetworkConfig, ThreeLayerNetwork
from ja_learning.core.trial import Trial
from ja_learning.learning_module_node import LearningModuleNode
from node_bench import header, joint_state

MS = 1_000_000
ATTENDED = Detection(Kind.FACE, 0.0, 0.0, 0, 0, 40, 48, 1.0, attended=True)
PASSING = Detection(Kind.FACE, 0.1, 0.0, 0, 0, 40, 48, 1.0)
FACE = np.random.default_rng(0).integers(0, 256, (30, 25)).astype(np.uint8)
SAYS = [DETECTIONS, FACE_IMAGE, FIXATION, JOINT_STATES]


class Life:
    """What the learner lives through, image after image; it answers each."""

    def __init__(self, bench):
        self.bench = bench
        self.ms = 0

    def look(self, face=FACE, pan=0.0):
        stamp_ns = self._tick(pan)
        self.bench.say(FACE_IMAGE, encode_image(face, header(stamp_ns).stamp, 'eye'))
        return self._see(stamp_ns, [ATTENDED])

    def rest(self, pan, detections=()):
        return self._see(self._tick(pan), list(detections))

    def pass_by(self, pan):
        return self._see(self._tick(pan, velocity=[0.5, 0.0]), [])

    def fixate(self, pan, direction):
        self._see(self._tick(pan), [], direction)

    def trial(self, direction=(0.4, 0.1)):
        """A whole trial: look, one shift, fixation."""
        self.look()
        before = self.learned
        self.fixate(0.3, direction)
        assert self.learned == before + 1

    @property
    def learned(self):
        return int(self.bench.node.health.values.get('trials learned', '0'))

    def _tick(self, pan, **more):
        self.ms += 100
        self.bench.say_posture(self.ms * MS, pan, **more)
        return self.ms * MS

    def _see(self, stamp_ns, detections, fixation=()):
        self.bench.say(DETECTIONS, encode_detections(header(stamp_ns), detections))
        answer = self.bench.next(LM_DELTA)
        assert answer.header == header(stamp_ns)
        self._say_fixation(stamp_ns, fixation)
        return answer

    def _say_fixation(self, stamp_ns, direction):
        before = self.bench.received(FIXATION)
        self.bench.say(FIXATION, joint_state(stamp_ns, *direction))
        self.bench.wait(lambda: self.bench.received(FIXATION) > before)


@pytest.fixture
def make_life(make_bench):
    def make(**parameters):
        return Life(make_bench(LearningModuleNode, SAYS, [LM_DELTA], **parameters))

    return make


@pytest.fixture
def life(make_life):
    return make_life()


def test_proposal_is_the_networks_at_the_posture_of_every_image_of_a_trial(life):
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    assert list(life.look().position) == pytest.approx(network.predict(FACE, (0, 0)))
    assert list(life.rest(0.3).position) == pytest.approx(network.predict(FACE, (0.3, 0)))


def test_nothing_is_proposed_before_a_look_and_after_the_fixation(life):
    assert not life.rest(0.0).name
    assert not life.rest(0.0, [PASSING]).name, 'a face that is not attended is no look'
    life.trial()
    assert not life.rest(0.3).name


def test_face_image_may_come_after_its_detections(life):
    stamp_ns = life._tick(0.0)
    life.bench.say(DETECTIONS, encode_detections(header(stamp_ns), [ATTENDED]))
    life.bench.say(FACE_IMAGE, encode_image(FACE, header(stamp_ns).stamp, 'eye'))
    assert life.bench.next(LM_DELTA).name


def test_fixation_teaches_the_trial_once(life):
    life.look()
    before = list(life.rest(0.0).position)
    life.look()
    life.fixate(0.3, (0.4, 0.1))
    life.fixate(0.3, (0.4, 0.1))
    assert life.learned == 1
    assert list(life.look().position) != before
    life.fixate(0.0, (0.4, 0.1))  # still where the look was: nothing was shifted
    assert life.learned == 1


def test_postures_at_rest_are_taught_and_those_passed_on_the_way_are_not(life):
    life.look()
    life.pass_by(0.1)
    life.rest(0.2)
    life.pass_by(0.25)
    life.fixate(0.3, (0.4, 0.1))
    network = ThreeLayerNetwork(NetworkConfig(), seed=0)
    network.learn(Trial(FACE, np.array([(0.0, 0.0), (0.2, 0.0)]), np.array((0.4, 0.1))))
    assert list(life.look().position) == pytest.approx(network.predict(FACE, (0, 0)), abs=1e-7)


def test_learning_moves_the_proposal_towards_the_fixation(make_life):
    life = make_life(learning_rate=0.01)
    target = np.array([0.4, 0.1])

    def distance():
        return np.linalg.norm(np.subtract(life.look().position, target))

    before = distance()
    for _ in range(10):
        life.trial(target)
    assert distance() < 0.8 * before


def test_disabled_learning_still_proposes(life):
    assert life.bench.call(SetBool, 'learning_enabled', data=False).success
    before = list(life.look().position)
    life.fixate(0.3, (0.4, 0.1))
    assert list(life.look().position) == before
    assert life.learned == 0
    life.bench.call(SetBool, 'learning_enabled', data=True)
    life.trial()


def test_reset_forgets_everything(life):
    untaught = list(life.look().position)
    life.trial()
    assert list(life.look().position) != untaught
    assert life.bench.call(Trigger, 'reset_learning').success
    assert not life.rest(0.0).name, 'the trial under way too'
    assert list(life.look().position) == untaught


def test_saved_learner_is_loaded_by_another(make_life, tmp_path):
    path = str(tmp_path / 'folder' / 'learner.npz')
    first = make_life(checkpoint_file=path)
    first.trial()
    assert first.bench.call(Trigger, 'save_checkpoint').message == f'1 trials saved to {path}'
    taught = list(first.look().position)
    first.bench.close()

    second = make_life(checkpoint_file=path, seed=5)
    assert list(second.look().position) != taught
    assert second.bench.call(Trigger, 'load_checkpoint').message == f'1 trials loaded from {path}'
    assert list(second.look().position) == taught


def test_checkpoint_is_saved_every_so_many_trials(make_life, tmp_path):
    path = tmp_path / 'learner.npz'
    life = make_life(checkpoint_file=str(path), checkpoint_every_trials=2)
    life.trial()
    assert not path.exists()
    life.trial()
    life.bench.wait(path.exists)


def test_checkpoint_without_a_place_or_of_another_kind_is_refused(make_life, tmp_path):
    nowhere = make_life()
    for service in ('save_checkpoint', 'load_checkpoint'):
        response = nowhere.bench.call(Trigger, service)
        assert not response.success
        assert 'checkpoint_file is empty' in response.message
    nowhere.bench.close()

    path = tmp_path / 'learner.npz'
    life = make_life(checkpoint_file=str(path))
    assert f'no checkpoint at {path}' in life.bench.call(Trigger, 'load_checkpoint').message
    path.write_text('weights')
    response = life.bench.call(Trigger, 'load_checkpoint')
    assert not response.success
    assert f'{path} is not a checkpoint' in response.message
    life.trial()


def test_learner_of_another_size_is_refused(make_life, tmp_path):
    path = str(tmp_path / 'learner.npz')
    small = make_life(checkpoint_file=path, hidden=3)
    assert small.bench.call(Trigger, 'save_checkpoint').success
    small.bench.close()
    response = make_life(checkpoint_file=path).bench.call(Trigger, 'load_checkpoint')
    assert not response.success
    assert 'hidden_weights must be numbers of shape (7, 752)' in response.message


@pytest.mark.parametrize(
    ('spoil', 'text'),
    [
        ({'encoding': 'magic8'}, 'magic8'),
        ({'width': 20, 'step': 20}, '30 rows x 25 columns'),
        ({'data': b''}, '0 bytes of data'),
    ],
)
def test_broken_face_image_is_one_clear_error_and_the_node_lives_on(life, spoil, text):
    stamp_ns = life._tick(0.0)
    message = encode_image(FACE, header(stamp_ns).stamp, 'eye')
    for name, value in spoil.items():
        setattr(message, name, value)
    life.bench.say(DETECTIONS, encode_detections(header(stamp_ns), [ATTENDED]))
    life.bench.say(FACE_IMAGE, message)
    life.bench.wait_for_complaint(text)
    assert '/face_image: ' in life.bench.complaint()
    life.trial()


def test_broken_fixation_is_one_clear_error_and_the_node_lives_on(life):
    life.look()
    life.bench.say(FIXATION, joint_state(life.ms * MS, float('nan'), 0.0))
    life.bench.wait_for_complaint('/fixation: position of')
    life.trial()


def test_another_learner_may_be_chosen_while_the_node_runs(make_bench):
    bench = make_bench(LearningModuleNode, says=SAYS, hears=[LM_DELTA])
    life = Life(bench)
    life.trial()
    assert bench.set_parameter('learner', 'gaze_line').successful
    red = Detection(Kind.OBJECT, -0.2, 0.1, 0, 0, 10, 10, 1.0)
    life.look()
    delta = life.rest(0.0, [red])
    assert delta.name
    refused = bench.set_parameter('learner', 'teacher')
    assert not refused.successful
    assert "'teacher' is not one of paper, gaze_line" in refused.reason


@pytest.mark.parametrize(('learner', 'samples'), [('paper', 1), ('gaze_line', 200)])
def test_the_belief_is_told_to_who_looks(make_bench, learner, samples):
    bench = make_bench(LearningModuleNode, SAYS, [LM_DELTA, BELIEF], learner=learner)
    life = Life(bench)
    life.rest(0.0)
    life.look(pan=0.1)
    bench.wait(lambda: len(bench.heard(BELIEF)) == 2)
    before, looking = bench.heard(BELIEF)
    assert before.width == 0, 'no trial is under way'
    told = decode_columns(looking, ('pan', 'tilt', 'weight'))
    assert len(told['pan']) == samples
    assert told['weight'].sum() == pytest.approx(1.0, abs=1e-5)
    assert np.mean(told['pan']) == pytest.approx(0.1, abs=0.1), 'an untaught belief is about her'
