"""Detections as a table."""

import os

import pytest
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import Header

from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import encode_detections
from ja_perception.echo_detections_node import EchoDetectionsNode, format_detections


def test_columns_stand_under_their_names():
    face = Detection(
        Kind.FACE, 0.0, 0.1, 160.0, 120.0, 50.0, 50.0, 0.9, 3, attended=True, range_m=1.2
    )
    ball = Detection(Kind.OBJECT, 0.1, 0.1, 20.5, 99.0, 8.0, 9.0, 0.25, 12, 0.25, 0.5, 0.75)
    title, head, *lines = format_detections(1_500_000_000, [face, ball]).splitlines()
    assert title == '1.500 s: 2 seen'
    assert lines[0].split() == [
        'face',
        '3',
        '160.0',
        '120.0',
        '50.0',
        '50.0',
        '0.90',
        *['0.00'] * 3,
        'yes',
        '1.20',
        'm',
    ]
    for name, value in (('score', '0.25'), ('f_edg', '0.50'), ('f_mot', '0.75')):
        end = head.index(name) + len(name)
        assert lines[1][:end].endswith(value)


def test_nothing_seen_is_said_too():
    assert format_detections(0, []) == '0.000 s: 0 seen'


def test_it_ends_when_its_reader_has_closed_the_pipe(monkeypatch, ros_context):
    """As `echo_detections | head` does: no error a message, but an end."""
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, 'w') as pipe:
        monkeypatch.setattr('sys.stdout', pipe)
        node = EchoDetectionsNode(context=ros_context)
        with pytest.raises(ExternalShutdownException):
            node.call_guarded('detections', node._on_detections, encode_detections(Header(), []))
        node.destroy_node()
