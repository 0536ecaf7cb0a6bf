"""What the stamps in the messages of a recording say when no trial comes out of it."""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

from ja_common.core.stamps import NS_PER_S
from ja_recording.core.reader import RecordedMessage

_STAMP_AT = 4
_STAMP_BYTES = 8


@dataclass
class _Stamps:
    """The stamps of one topic: how many, how many zero, how often they went back."""

    messages: int = 0
    zero: int = 0
    backward: int = 0
    last_ns: int = 0
    known: set[int] = field(default_factory=set)


class RecordedStamps:
    """Counts of the stamps of some topics, whose messages begin with a std_msgs/Header."""

    def __init__(self, topics: Sequence[str]) -> None:
        self._topics = topics
        self._stamps: dict[str, _Stamps] = defaultdict(_Stamps)

    def count_message(self, message: RecordedMessage) -> None:
        """Count a message if it is of one of the topics."""
        name = message.topic.name
        if name in self._topics and (stamp_ns := header_stamp_ns(message.data)) is not None:
            stamps = self._stamps[name]
            stamps.messages += 1
            stamps.zero += stamp_ns == 0
            stamps.backward += stamp_ns < stamps.last_ns
            stamps.last_ns = stamp_ns
            stamps.known.add(stamp_ns)

    def problems(self) -> list[str]:
        """Return a sentence for each topic whose stamps cannot be right."""
        found = []
        for name, stamps in self._stamps.items():
            if stamps.zero > 1:  # a simulation begins at 0
                found.append(
                    f'{name}: {stamps.zero} of {stamps.messages} messages have the stamp 0, so '
                    'nothing of the same time is found: their publisher has to set header.stamp'
                )
            elif stamps.backward:
                found.append(
                    f'{name}: the stamps of {stamps.backward} of {stamps.messages} messages are '
                    'older than the stamp before: the clock of their publisher was set, or two '
                    'publishers shared the topic'
                )
        return found

    def share_a_stamp(self, first: str, second: str) -> bool:
        """Return whether any message of one topic has the stamp of one of the other."""
        return not self._stamps[first].known.isdisjoint(self._stamps[second].known)


def header_stamp_ns(data: bytes) -> int | None:
    """Return the stamp [ns] of a CDR message that begins with a header; None of a short one."""
    if len(data) < _STAMP_AT + _STAMP_BYTES:
        return None
    order = '<' if data[1] & 1 else '>'
    seconds, nanoseconds = struct.unpack_from(f'{order}iI', data, _STAMP_AT)
    return int(seconds) * NS_PER_S + int(nanoseconds)
