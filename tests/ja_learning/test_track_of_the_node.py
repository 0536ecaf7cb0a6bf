"""`learning_module` publishes its track, and notices other weight files of the eyes."""

import pytest

from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import encode_detections
from ja_common.topics import DETECTIONS, JOINT_STATES, LM_DELTA, TRACK, WEIGHT_FILES
from ja_common.weight_files_codec import encode_weight_files
from ja_learning.core.checkpoint import load_checkpoint
from ja_learning.learning_module_node import LearningModuleNode
from node_bench import header

EYES, OTHER_EYES = {'face.onnx': 'a' * 64}, {'face.onnx': 'b' * 64}
NEAR = Detection(
    Kind.OBJECT, 0.1, 0.0, 100.0, 60.0, 9.0, 9.0, 0.9, range_m=1.2, range_deviation_m=0.02
)


@pytest.fixture
def make(make_bench, tmp_path):
    def start(**parameters):
        return make_bench(
            LearningModuleNode,
            [WEIGHT_FILES, DETECTIONS, JOINT_STATES],
            [TRACK, LM_DELTA],
            checkpoint_folder=str(tmp_path / 'checkpoints'),
            learner='gaze_line',
            **parameters,
        )

    return start


def tracks(bench):
    return [message.data for message in bench.messages(TRACK)]


def open_eyes(bench, files):
    before = bench.received(WEIGHT_FILES)
    bench.publish(WEIGHT_FILES, encode_weight_files('/eyes', files))
    bench.wait(lambda: bench.received(WEIGHT_FILES) > before)


@pytest.mark.parametrize(('reader', 'track'), [('pixels', 'strict'), ('landmarks', 'landmarks')])
def test_a_late_subscriber_gets_the_track(make, reader, track):
    bench = make(face_reader=reader)
    bench.wait(lambda: tracks(bench))
    assert tracks(bench) == [track]


@pytest.mark.parametrize(('may', 'track'), [(True, 'strict with depth'), (False, 'strict')])
def test_ranges_are_used_where_they_are_allowed(make, may, track):
    bench = make(use_ranges=may)
    (found,) = bench.node._learner.allowed([NEAR])
    assert (found.range_m == NEAR.range_m) == may
    bench.wait(lambda: tracks(bench)[-1:] == [track])


@pytest.mark.parametrize(('may', 'last'), [(True, 'strict with depth'), (False, 'strict')])
def test_detections_with_ranges_give_the_track_depth(make, may, last):
    bench = make(use_ranges=may)
    bench.publish_posture(100_000_000)
    bench.publish(DETECTIONS, encode_detections(header(100_000_000), [NEAR]))
    bench.next(LM_DELTA)
    assert str(bench.node._learner.track) == last


def test_a_checkpoint_names_the_weight_files_and_a_restart_with_others_warns(make, tmp_path):
    bench = make()
    open_eyes(bench, EYES)
    bench.node._learner._on_save(None, _Response())
    [path] = (tmp_path / 'checkpoints').glob('gaze_line-*.npz')
    assert load_checkpoint(path)[1]['weight_files'] == EYES
    bench.close()

    again = make()
    open_eyes(again, EYES)
    assert 'weight files' not in again.complaint()
    open_eyes(again, OTHER_EYES)
    again.wait_for_complaint(f'face.onnx was {"a" * 16} and is {"b" * 16}')


def test_what_is_no_hash_is_a_problem_of_the_node(make):
    bench = make()
    bench.publish(WEIGHT_FILES, encode_weight_files('/eyes', {'face.onnx': 'none'}))
    bench.wait_for_complaint('is no SHA-256')


class _Response:
    success, message = False, ''
