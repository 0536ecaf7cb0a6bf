"""What the eyes and the learner of a recorded graph started from, kept as texts by topic."""

from collections.abc import Callable, Mapping

from rclpy.serialization import deserialize_message

from ja_common.core.weight_files import weight_files_text
from ja_common.message_types import type_name_of
from ja_common.topics import TRACK, WEIGHT_FILES, Topic
from ja_common.weight_files_codec import decode_weight_files

_TEXT_OF: Mapping[Topic, Callable[..., str]] = {
    TRACK: lambda message: message.data,
    WEIGHT_FILES: lambda message: weight_files_text(decode_weight_files(message)),
}
_LONGEST_TEXT = 4000


def origin_topic(name: str, type_name: str) -> Topic | None:
    """Return which topic of an origin, in any namespace, this one is; None if it is another."""
    for topic in _TEXT_OF:
        if name.endswith(f'/{topic.name}') and type_name == type_name_of(topic.type):
            return topic
    return None


def origin_text(topic: Topic, data: bytes) -> str:
    """Return what a message of such a topic, as it was on the wire, names.

    Raises ValueError when it holds something else.
    """
    try:
        message = deserialize_message(data, topic.type)
    except Exception as error:  # rclpy raises classes of its C extension, which has no public name
        raise ValueError(f'{topic.name} is no {type_name_of(topic.type)}: {error}') from None
    return _TEXT_OF[topic](message)[:_LONGEST_TEXT]
