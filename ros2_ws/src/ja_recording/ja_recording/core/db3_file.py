"""One SQLite file of rosbag2 (`.db3`), its default before Iron: every version of its tables.

The file comes from anybody. It is opened for reading alone, nothing but plain tables is read, and
SQLite gets no more steps than a file of this size can need: a damaged tree of pages could have it
walk in circles.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from ja_recording.core.storage import (
    LARGEST_BYTES,
    LATEST_NS,
    MOST_TOPICS,
    DamagedError,
    StoredChannel,
    StoredMessage,
)

MAGIC = b'SQLite format 3\0'

_STEPS_PER_CALL = 100_000
# A row takes at least some bytes, and some dozen steps to read and to sort.
_STEPS_PER_BYTE = 16
_STEPS_AT_LEAST = 10**7
_TOPIC_COLUMNS = ('id', 'name', 'type', 'serialization_format')
# SQLite's own tables have rows whose number is called rowid, whatever the columns are.
_IN_ORDER = 'SELECT rowid FROM messages ORDER BY timestamp, rowid'
_ONE = (
    "SELECT topic_id, timestamp, CASE WHEN typeof(data) = 'blob' AND length(data) <= ? "
    'THEN data END FROM messages WHERE rowid = ?'
)


class Db3File:
    """The topics of a file, and its messages in the order of their stamps.

    Raises DamagedError when it is no file of rosbag2.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.finished = not _journal(path)
        self.cut_short = ''
        self.damaged: list[tuple[str, str]] = []
        with closing(self._open()) as database:
            try:
                self.stored_channels = _channels(database)
                self.span_ns = _span_ns(database)
            except (sqlite3.Error, UnicodeDecodeError) as error:
                raise DamagedError(_why(error)) from None

    def messages(self, channels: Collection[int]) -> Iterator[StoredMessage]:
        """Yield the messages of some channels in the order of their stamps.

        Damaged messages are left out. Raises DamagedError where the rest cannot be read.
        """
        with closing(self._open()) as database:
            try:
                for (row,) in database.execute(_IN_ORDER):
                    found = database.execute(_ONE, (LARGEST_BYTES, row)).fetchone()
                    if found is None or found[0] in channels:
                        yield from self._checked(row, found)
            except sqlite3.Error as error:
                raise DamagedError(_why(error)) from None

    def _checked(self, row: int, found: tuple[Any, ...] | None) -> Iterator[StoredMessage]:
        channel, stamp_ns, data = found or (0, 0, b'')
        if found is None:
            self.damaged.append((f'row {row}', 'its index names a message that is not there'))
        elif not isinstance(data, bytes):
            self.damaged.append((f'row {row}', f'no message of at most {LARGEST_BYTES} bytes'))
        elif isinstance(stamp_ns, int) and 0 <= stamp_ns <= LATEST_NS:
            yield StoredMessage(channel, stamp_ns, data)
        else:
            self.damaged.append((f'row {row}', f'{str(stamp_ns)[:30]} ns is no time of ROS'))

    def _open(self) -> sqlite3.Connection:
        # Immutable: without a lock, so that a folder that cannot be written is no obstacle. But
        # then SQLite does not look for what a killed recorder has left beside the file.
        how = 'mode=ro' if _journal(self.path) else 'mode=ro&immutable=1'
        steps_left = _STEPS_AT_LEAST + _STEPS_PER_BYTE * self.path.stat().st_size

        def count_steps() -> bool:
            nonlocal steps_left
            steps_left -= _STEPS_PER_CALL
            return steps_left < 0

        try:
            database = sqlite3.connect(
                f'{self.path.absolute().as_uri()}?{how}', uri=True, check_same_thread=False
            )
            database.execute('PRAGMA trusted_schema = OFF')
            database.set_progress_handler(count_steps, _STEPS_PER_CALL)
        except sqlite3.Error as error:
            raise DamagedError(_why(error)) from None
        return database


def _channels(database: sqlite3.Connection) -> dict[int, StoredChannel]:
    _columns(database, 'messages', ('topic_id', 'timestamp', 'data'))
    known = _columns(database, 'topics', _TOPIC_COLUMNS)
    # The first versions did not keep it.
    offered = 'offered_qos_profiles' if 'offered_qos_profiles' in known else "''"
    rows = database.execute(
        f'SELECT {", ".join(_TOPIC_COLUMNS)}, {offered} FROM topics LIMIT {MOST_TOPICS + 1}'
    ).fetchall()
    if len(rows) > MOST_TOPICS:
        raise DamagedError(f'it has more than {MOST_TOPICS} topics')
    if not all(isinstance(value, str) for row in rows for value in row[1:]):
        raise DamagedError('its table of topics holds no texts')
    return {number: StoredChannel(*texts) for number, *texts in rows}


def _columns(database: sqlite3.Connection, table: str, needed: Collection[str]) -> set[str]:
    """Return the columns of a table. Raises DamagedError when it is none, or lacks one of them."""
    # A view, a virtual table or a computed column would have SQLite run what the file says.
    plain = database.execute(
        "SELECT 1 FROM sqlite_master WHERE name = ? AND type = 'table' AND rootpage > 0", (table,)
    ).fetchone()
    columns = database.execute(f'PRAGMA table_xinfo({table})').fetchall() if plain else []
    stored = {name for _, name, *_, hidden in columns if not hidden}
    if not stored.issuperset(needed):
        raise DamagedError(f'it is no recording of rosbag2: no table {table} in it')
    return stored


def _span_ns(database: sqlite3.Connection) -> tuple[int, int] | None:
    stamps = database.execute(
        'SELECT min(timestamp), max(timestamp) FROM messages '
        f'WHERE timestamp BETWEEN 0 AND {LATEST_NS}'
    ).fetchone()
    return None if stamps[0] is None else (int(stamps[0]), int(stamps[1]))


def _journal(path: Path) -> bool:
    """Return whether the recorder has left a log of its last messages beside the file."""
    log = path.with_name(f'{path.name}-wal')
    return log.is_file() and log.stat().st_size > 0


def _why(error: Exception) -> str:
    if 'interrupted' in str(error):
        return 'it is damaged: SQLite does not come to an end with it'
    if 'malformed' in str(error) or 'not a database' in str(error):
        return f'{error}; `sqlite3 FILE.db3 .recover | sqlite3 NEW.db3` saves what is whole'
    if 'unable to open' in str(error):
        return f'{error}; copy its folder to where it can be written, and read it there'
    return str(error).partition('\n')[0][:200]
