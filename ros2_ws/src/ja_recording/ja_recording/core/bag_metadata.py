"""The metadata.yaml of a recording: what of it is needed to read the files beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from ja_common.core.config import ConfigError
from ja_common.core.safe_files import compose_yaml, construct_yaml, read_text

NAME = 'metadata.yaml'

# A list of some thousand files is longer than a configuration.
_LARGEST_BYTES = 8 * 2**20


@dataclass(frozen=True)
class BagMetadata:
    """What a metadata.yaml names; whatever else its version adds is not needed.

    `files`: names of files, in order. `types`: types of messages, by topic. `storage`: the format
    of the files. `custom_data`: texts that its recorder added. `problem`: why nothing could be
    read.
    """

    files: list[str] = field(default_factory=list)
    types: dict[str, str] = field(default_factory=dict)
    storage: str = ''
    custom_data: dict[str, str] = field(default_factory=dict)
    problem: str = ''


def read_metadata(folder: Path) -> BagMetadata:
    """Return what the metadata.yaml of a folder names; nothing where there is none.

    rosbag2 does not read a recording without it. Here it may lack or be damaged: the files tell
    nearly all by themselves.
    """
    path = folder / NAME
    if not path.exists():
        return BagMetadata()
    try:
        table = construct_yaml(compose_yaml(read_text(path, _LARGEST_BYTES), str(path)), str(path))
    except ConfigError as error:
        return BagMetadata(problem=f'{error}: it is not used')
    found = _table(_table(table).get('rosbag2_bagfile_information'))
    if not found:
        return BagMetadata(problem=f'{path} is no metadata of rosbag2: it is not used')
    # The first versions wrote the folder before the name. No name leads out of the folder.
    listed = [
        PurePosixPath(each).name
        for each in _list(found.get('relative_file_paths'))
        if isinstance(each, str)
    ]
    topics = [
        _table(_table(each).get('topic_metadata'))
        for each in _list(found.get('topics_with_message_count'))
    ]
    types = {str(topic.get('name')): str(topic.get('type', '')) for topic in topics}
    storage = found.get('storage_identifier')
    return BagMetadata(
        [name for name in dict.fromkeys(listed) if name],
        types,
        storage if isinstance(storage, str) else '',
        {str(key): str(text) for key, text in _table(found.get('custom_data')).items()},
    )


def _table(value: Any) -> dict[Any, Any]:
    return value if isinstance(value, dict) else {}


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
