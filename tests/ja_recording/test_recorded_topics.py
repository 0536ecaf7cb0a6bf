"""Trials of recordings with other names, other files, and stamps that cannot be right."""

from dataclasses import replace

import pytest
from sensor_msgs.msg import CompressedImage
from typer.testing import CliRunner

from foreign_bags import write_db3
from ja_bringup.cli import app
from ja_common.core.config import ConfigError
from ja_common.message_types import type_name_of
from ja_common.time_codec import to_time
from ja_common.topics import DETECTIONS, FACE_IMAGE, FIXATION, IMAGE_COMPRESSED, JOINT_STATES
from ja_recording.core.reader import Recording
from ja_recording.learner_score import score_learner
from ja_recording.recorded_stamps import header_stamp_ns
from recorded_days import day, messages_of, recorded
from recordings import write_recording

TRIALS = 3


def in_namespace(path, namespace: str = 'head'):
    """Write a recording whose topics are in a namespace."""
    messages = (
        (stamp_ns, replace(topic, name=f'{namespace}/{topic.name}'), message)
        for stamp_ns, topic, message in messages_of(day(TRIALS))
    )
    return Recording(write_recording(path, messages))


def test_topics_of_a_namespace_are_found_by_it(tmp_path):
    plain = score_learner(recorded(tmp_path / 'a', count=TRIALS))
    assert len(plain) == TRIALS
    assert score_learner(in_namespace(tmp_path / 'b'), ['-r', '__ns:=/head']) == plain


def test_topics_are_remapped_one_by_one_as_the_sentence_says(tmp_path):
    recording = in_namespace(tmp_path / 'r')
    with pytest.raises(ConfigError, match='under other names') as refused:
        score_learner(recording)
    arguments = str(refused.value).split('--ros-args ')[1].rstrip('`').split()
    assert arguments[1] == f'{DETECTIONS.name}:=/head/{DETECTIONS.name}'
    assert len(score_learner(recording, arguments)) == TRIALS


def test_the_same_trials_come_from_sqlite(tmp_path):
    recording = recorded(tmp_path / 'a', count=TRIALS)
    topics = [(topic.name, topic.type_name, 'cdr') for topic in recording.topics.values()]
    number = {name: place for place, (name, *_) in enumerate(topics, 1)}
    rows = [(number[each.topic.name], each.stamp_ns, each.data) for each in recording.messages()]
    converted = Recording(write_db3(tmp_path / 'b.db3', topics, rows))
    assert score_learner(converted) == score_learner(recording)


def test_a_recording_of_pictures_alone_names_the_way(tmp_path):
    messages = [(n, IMAGE_COMPRESSED, CompressedImage()) for n in range(3)]
    recording = Recording(write_recording(tmp_path / 'r', messages))
    with pytest.raises(ConfigError, match='compressed:=true') as refused:
        score_learner(recording)
    assert f'/{IMAGE_COMPRESSED.name}' in str(refused.value)


def test_a_topic_that_is_left_out_names_why(tmp_path):
    recording = recorded(tmp_path / 'a', count=1)
    topics = [
        (topic.name, topic.type_name, 'x' if topic.name == f'/{FIXATION.name}' else 'cdr')
        for topic in recording.topics.values()
    ]
    with pytest.raises(ConfigError, match=r"/fixation is left out, since .* encoding 'x'"):
        score_learner(Recording(write_db3(tmp_path / 'b.db3', topics)))


def restamped(topic, change):
    """Yield the messages of a day; `change` returns another stamp [ns] for those of one topic."""
    for stamp_ns, each, message in messages_of(day(TRIALS)):
        if each is topic:
            message.header.stamp = to_time(change(stamp_ns))
        yield stamp_ns, each, message


@pytest.mark.parametrize('topic', [DETECTIONS, FIXATION, FACE_IMAGE], ids=lambda topic: topic.name)
def test_zero_stamps_are_named(topic, tmp_path, capsys):
    recording = Recording(write_recording(tmp_path / 'r', restamped(topic, lambda _: 0)))
    score_learner(recording)
    assert f'/{topic.name}: ' in (said := capsys.readouterr().err)
    assert 'have the stamp 0' in said


def test_stamps_that_go_back_are_named(tmp_path, capsys):
    messages = restamped(JOINT_STATES, lambda stamp_ns: 10**9 - stamp_ns)
    score_learner(Recording(write_recording(tmp_path / 'r', messages)))
    assert f'/{JOINT_STATES.name}: the stamps of 5 of 6 messages' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('keep', 'change', 'why'),
    [
        (lambda stamp, topic: topic is not FACE_IMAGE, 0, 'lacks /face_image'),
        (lambda stamp, topic: stamp % 200_000_000, 0, 'never shows a face'),
        (lambda stamp, topic: True, 17, 'no stamp in common'),
        (lambda stamp, topic: topic is not FIXATION or not stamp % 200_000_000, 0, 'no fixation'),
    ],
    ids=['no picture', 'no face', 'other stamps', 'no fixation'],
)
def test_why_there_is_no_trial_is_named(keep, change, why, tmp_path, capsys):
    messages = [
        each
        for each in restamped(FACE_IMAGE, lambda stamp_ns: stamp_ns + change)
        if keep(each[0], each[1])
    ]
    assert score_learner(Recording(write_recording(tmp_path / 'r', messages))) == []
    assert why in capsys.readouterr().err


def test_a_recording_of_which_all_is_well_says_nothing(tmp_path, capsys):
    score_learner(recorded(tmp_path / 'a', count=TRIALS))
    assert capsys.readouterr().err == ''


def test_topics_are_left_out_of_a_score_as_well(tmp_path):
    recorded(tmp_path / 'a', count=1)
    command = ['replay', str(tmp_path / 'a'), '--score', '--without', FIXATION.name]
    with pytest.raises(ConfigError, match='lacks fixation'):
        CliRunner().invoke(app, command, obj=[], catch_exceptions=False)


@pytest.mark.parametrize('more', [['--csv', 'x.csv'], ['--json'], ['--score', '--speed', '2']])
def test_an_option_that_would_do_nothing_is_refused(more, tmp_path):
    done = CliRunner().invoke(app, ['replay', str(tmp_path), *more], obj=[])
    assert done.exit_code == 2


def test_a_stamp_is_read_in_either_byte_order():
    assert header_stamp_ns(b'\0\1\0\0\2\0\0\0\3\0\0\0') == 2_000_000_003
    assert header_stamp_ns(b'\0\0\0\0\0\0\0\2\0\0\0\3') == 2_000_000_003
    assert header_stamp_ns(b'\0\1\0\0') is None


def test_the_type_of_a_topic_has_the_name_of_the_recording(tmp_path):
    recording = recorded(tmp_path / 'a', count=1)
    assert recording.topics[f'/{DETECTIONS.name}'].type_name == type_name_of(DETECTIONS.type)
