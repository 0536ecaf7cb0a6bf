"""A recording keeps what learner and eyes started from, and leaves out what is large."""

import re

import pytest
import yaml
from std_msgs.msg import String

from ja_common.topics import (
    DEPTH,
    FACE_GAZE,
    FACE_LANDMARKS,
    IMAGE,
    IMAGE_ANNOTATED,
    RIGHT_CAMERA_INFO,
    RIGHT_IMAGE,
    TRACK,
    WEIGHT_FILES,
)
from ja_common.weight_files_codec import encode_weight_files
from ja_recording.core.bag_metadata import read_metadata
from ja_recording.core.dataset import CARD, TrialSample, write_dataset
from ja_recording.core.default_exclude import DEFAULT_EXCLUDE
from ja_recording.core.reader import Recording
from ja_recording.recorder_node import RecorderNode
from made_up_trials import trial

EYES = {'face.onnx': 'a' * 64}
TEXTS = {'/learning_module/track': 'strict with depth', '/weight_files': f'face.onnx={"a" * 16}'}


def test_metadata_names_track_and_weight_files(make_bench, tmp_path):
    bench = make_bench(RecorderNode, folder=str(tmp_path / 'r'))
    topics = (TRACK, WEIGHT_FILES, FACE_GAZE)
    publishers = {t: bench.peer.create_publisher(t.type, t.name, t.publisher_qos) for t in topics}
    # Latched: they are older than the recorder's subscription.
    publishers[TRACK].publish(String(data='strict'))
    publishers[WEIGHT_FILES].publish(encode_weight_files('/eyes', EYES))
    bench.wait(lambda: publishers[FACE_GAZE].get_subscription_count())
    publishers[FACE_GAZE].publish(FACE_GAZE.type())
    bench.wait(lambda: bench.node._recording.custom_data.keys() == TEXTS.keys())
    publishers[TRACK].publish(String(data='strict with depth'))
    bench.wait(lambda: bench.node._recording.custom_data == TEXTS)
    bench.node.writer.close()
    assert read_metadata(tmp_path / 'r').custom_data == TEXTS
    assert {'/learning_module/track', '/weight_files', '/face_gaze'} <= set(
        Recording(tmp_path / 'r').topics
    )


def test_a_message_that_is_none_costs_no_recording(make_bench, tmp_path):
    bench = make_bench(RecorderNode, folder=str(tmp_path / 'r'))
    publisher = bench.peer.create_publisher(
        WEIGHT_FILES.type, WEIGHT_FILES.name, WEIGHT_FILES.publisher_qos
    )
    publisher.publish(encode_weight_files('/eyes', {'face.onnx': 'no hash'}))
    bench.wait_for_complaint('is no SHA-256')
    bench.wait(lambda: bench.node.writer.written)
    bench.node.writer.close()
    assert '/weight_files' in Recording(tmp_path / 'r').topics


def test_metadata_of_other_recorders_has_no_such_texts(tmp_path):
    (tmp_path / 'metadata.yaml').write_text(
        yaml.safe_dump({'rosbag2_bagfile_information': {'version': 5, 'custom_data': None}})
    )
    assert read_metadata(tmp_path).custom_data == {}


@pytest.mark.parametrize(
    ('topic', 'left_out'),
    [
        (IMAGE_ANNOTATED, True), (FACE_LANDMARKS, True), (DEPTH, True), (RIGHT_IMAGE, True),
        (IMAGE, False), (RIGHT_CAMERA_INFO, False), (FACE_GAZE, False), (WEIGHT_FILES, False),
        (TRACK, False),
    ],
    ids=lambda value: getattr(value, 'name', ''),
)  # fmt: skip
def test_what_is_left_out_unasked(topic, left_out):
    assert bool(re.search(DEFAULT_EXCLUDE, f'/left/{topic.name}')) == left_out


def test_the_card_of_a_data_set_names_them(tmp_path):
    samples = [TrialSample(trial(1), name, 1, 2) for name in ('with', 'without')]
    write_dataset(tmp_path / 'data', samples, (), '', {'with': TEXTS})
    card = (tmp_path / 'data' / CARD).read_text()
    assert '* `with`: `/learning_module/track` strict with depth, `/weight_files` face' in card
    assert '* `without`: not recorded' in card
