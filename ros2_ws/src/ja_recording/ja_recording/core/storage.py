"""What the files of a recording have in common, whatever their format: MCAP or SQLite."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

LARGEST_BYTES = 256 * 2**20
"""Of a message, and of a chunk when it is unpacked. Recorders write chunks of some MB."""

MOST_TOPICS = 1000

LATEST_NS = (2**31 - 1) * 10**9
"""The last time that a ROS stamp can hold, in 2038."""


class DamagedError(Exception):
    """A part of a file that cannot be used; the message says why."""


@dataclass(frozen=True)
class StoredChannel:
    """A channel as the file describes it; '' for what it does not name.

    `encoding`: of the messages, `cdr` for ROS 2. `offered_qos`: rosbag2's YAML.
    """

    topic: str
    type_name: str
    encoding: str
    offered_qos: str = ''


class StoredMessage(NamedTuple):
    """The bytes of one message, and when it was recorded [ns]."""

    channel_id: int
    stamp_ns: int
    data: bytes


class StorageFile(Protocol):
    """One file of a recording.

    `finished`: the recorder has closed it. `cut_short`: why nothing behind the last part can be
    read, '' when it is the end. `damaged`: what has been left out so far: (where, reason).
    """

    path: Path
    finished: bool
    cut_short: str
    damaged: list[tuple[str, str]]

    @property
    def stored_channels(self) -> dict[int, StoredChannel]:
        """Return the channels by their number."""

    @property
    def span_ns(self) -> tuple[int, int] | None:
        """Return the first and the last stamp; None without messages."""

    def messages(self, channels: Collection[int]) -> Iterator[StoredMessage]:
        """Yield the messages of some channels in the order of their stamps.

        Raises OSError, and DamagedError when the rest cannot be read.
        """
