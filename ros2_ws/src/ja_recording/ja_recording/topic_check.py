"""Whether a recording has the topics that a node needs, under their names or others."""

from collections.abc import Collection, Mapping

from ja_common.core.config import ConfigError
from ja_common.message_types import type_name_of
from ja_common.topics import IMAGE, IMAGE_COMPRESSED, Topic
from ja_recording.core.reader import Recording


def check_topics(
    recording: Recording, name_of: Mapping[Topic, str], needed: Collection[Topic]
) -> None:
    """Check that a recording holds the needed ones of the topics that a node would subscribe.

    `name_of`: their resolved names. Raises ConfigError that names what lacks, and the remappings
    where other names would do.
    """
    absent = {topic: name for topic, name in name_of.items() if name not in recording.topics}
    lacking = {topic: name for topic, name in absent.items() if topic in needed}
    if not lacking:
        return
    names = ', '.join(name.lstrip('/') for name in lacking.values())
    why = [
        f'{name} is left out, since {recording.left_out[name]}'
        for name in lacking.values()
        if name in recording.left_out
    ]
    others = [
        f'-r {topic.name}:={found}'
        for topic in absent
        if (found := _under_another_name(recording, topic))
    ]
    if others:
        why.append(f'it has such topics under other names: add `--ros-args {" ".join(others)}`')
    elif pictures := _pictures(recording):
        why.append(
            f'it has pictures ({pictures}), which are not looked at here: `./ja replay` it beside '
            'a graph with use_sim_time that `./ja record` records, then use that recording'
        )
    raise ConfigError(
        f'the recording lacks {names}: nothing to learn from'
        + ''.join(f'; {each}' for each in why)
    )


def _under_another_name(recording: Recording, topic: Topic) -> str:
    ends = f'/{topic.name}'
    found = [
        name
        for name, recorded in recording.topics.items()
        if name.endswith(ends) and recorded.type_name == type_name_of(topic.type)
    ]
    return min(found, key=len, default='')


def _pictures(recording: Recording) -> str:
    kinds = {type_name_of(topic.type) for topic in (IMAGE, IMAGE_COMPRESSED)}
    found = [name for name, topic in recording.topics.items() if topic.type_name in kinds]
    if not found:
        return ''
    compressed = all(name.endswith('/compressed') for name in found)
    return found[0] + (
        ', compressed: start the detector with compressed:=true' if compressed else ''
    )
