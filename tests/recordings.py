"""Recordings of chosen messages, for tests."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rclpy.serialization import serialize_message

from ja_common.qos_text import offered_text
from ja_common.topics import Topic
from ja_recording.recording_folder import Channel, Limits, RecordingFolder

T0_NS = 1_700_000_000_000_000_000


def write_recording(
    path: Path, messages: Iterable[tuple[int, Topic, Any]], limits: Limits | None = None
) -> Path:
    """Write a finished recording of (time since the first [ns], topic, message)."""
    folder = RecordingFolder(path, limits or Limits())
    for number, (stamp_ns, topic, message) in enumerate(messages):
        folder.write_message(
            channel_of(topic), serialize_message(message), T0_NS + stamp_ns, T0_NS + stamp_ns,
            number,
        )  # fmt: skip
    folder.close()
    return path


def channel_of(topic: Topic) -> Channel:
    """Return the channel that a recorder would make for the topic."""
    package = topic.type.__module__.split('.')[0]
    name = f'/{topic.name.lstrip("/")}'
    return Channel(
        name, f'{package}/msg/{topic.type.__name__}', offered_text([topic.publisher_qos])
    )
