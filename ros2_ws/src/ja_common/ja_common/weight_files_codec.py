"""The weight files of a graph's eyes on the wire: file name -> SHA-256, as key and value."""

import re
from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ja_common.status_values import status_values

_SHA256 = re.compile(r'[0-9a-f]{64}')
_MOST_FILES = 32
_LONGEST_NAME = 100


def encode_weight_files(node: str, files: Mapping[str, str]) -> DiagnosticStatus:
    """Return the message of a node that has opened these files."""
    return DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name=node,
        message=f'{len(files)} files of learned weights were opened',
        values=[KeyValue(key=name, value=files[name]) for name in sorted(files)],
    )


def decode_weight_files(message: DiagnosticStatus) -> dict[str, str]:
    """Return name -> SHA-256.

    Raises ValueError when a value is no SHA-256, or when there are more files, or longer names,
    than a graph has.
    """
    files = status_values(message)
    if len(message.values) > _MOST_FILES or any(len(name) > _LONGEST_NAME for name in files):
        raise ValueError(f'weight_files holds more than {_MOST_FILES} files, or too long names')
    for name, digest in files.items():
        if not _SHA256.fullmatch(digest):
            raise ValueError(f'weight_files: {digest[:70]!r} of {name!r} is no SHA-256')
    return files
