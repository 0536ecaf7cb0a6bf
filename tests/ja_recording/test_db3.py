"""SQLite recordings of rosbag2: every version of its tables, and whatever else a file may hold."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from foreign_bags import FLOAT, INDEX, MESSAGES, RATES, TABLES, write_db3
from ja_common.core.config import ConfigError
from ja_recording.core import db3_file
from ja_recording.core.reader import Recording


def read(path: Path) -> list[bytes]:
    return [message.data for message in Recording(path).messages()]


@pytest.mark.parametrize('version', [1, 2, 4])
@pytest.mark.parametrize('indexed', [True, False])
def test_every_version_of_the_tables_is_read(version, indexed, tmp_path):
    rows = [(1, 6 - n, data) for n, data in enumerate(RATES)]
    write_db3(tmp_path / 'x_0.db3', rows=rows, version=version, indexed=indexed)
    recording = Recording(tmp_path)
    assert [message.data for message in recording.messages()] == RATES[::-1]
    assert (recording.first_ns, recording.last_ns) == (1, 6)
    assert recording.topics['/rate'].type_name == FLOAT
    assert recording.remarks == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ['x_0.db3']


def test_a_topic_of_another_format_blocks_no_other(tmp_path):
    topics = [('/rate', FLOAT, 'cdr'), ('/a', 'x/msg/Y', 'fast_json')]
    rows = [(1 + n % 2, n, data) for n, data in enumerate(RATES)]
    recording = Recording(write_db3(tmp_path / 'x.db3', topics, rows))
    assert [message.data for message in recording.messages()] == RATES[::2]
    assert "/a is left out: its messages have the encoding 'fast_json'" in recording.remarks[0]


def test_what_a_killed_recorder_has_in_its_log_is_read(tmp_path):
    path = write_db3(tmp_path / 'x.db3', rows=[])
    killed = sqlite3.connect(path)
    try:
        killed.execute('PRAGMA journal_mode = WAL')
        killed.execute('INSERT INTO messages VALUES (1, 1, 7, ?)', (RATES[3],))
        killed.commit()
        recording = Recording(path)
        assert [message.data for message in recording.messages()] == [RATES[3]]
        assert 'was not closed' in recording.remarks[0]
    finally:
        killed.close()


def test_messages_that_are_none_are_left_out(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(db3_file, 'LARGEST_BYTES', 100)
    rows = [
        (1, 5, RATES[5]), (1, 1, 'a text'), (1, 2, 17), (1, 3, bytes(101)),
        (1, -4, RATES[0]), (1, 2**62, RATES[0]), (1, 'soon', RATES[0]), (9, 4, RATES[0]),
    ]  # fmt: skip
    recording = Recording(write_db3(tmp_path / 'x.db3', rows=rows))
    assert [message.data for message in recording.messages()] == [RATES[5]]
    assert '6 damaged parts were left out; at row' in capsys.readouterr().err


def database_of(path: Path, *statements: str) -> Path:
    with closing(sqlite3.connect(path)) as database:
        for statement in statements:
            database.execute(statement)
        database.commit()
    return path


TOPIC = f"INSERT INTO topics VALUES (1, '/rate', '{FLOAT}', 'cdr', '', '')"
ENDLESS = 'WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT '
HOSTILE = {
    'no tables': ['CREATE TABLE a(b)'],
    'no topics': [MESSAGES],
    'other columns': [TABLES[4], TOPIC, 'CREATE TABLE messages(a, b)'],
    'a view without end': [
        TABLES[4], TOPIC,
        f'CREATE VIEW messages AS {ENDLESS} 1 AS topic_id, x AS timestamp, x AS data FROM c',
    ],
    'a view of topics': [
        MESSAGES,
        'CREATE VIEW topics AS SELECT 1 AS id, 2 AS name, 3 AS type, 4 AS serialization_format',
    ],
    'computed data': [
        TABLES[4], TOPIC,
        'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, '
        'data AS (zeroblob(500000000)))',
    ],
    'topics of numbers': [
        MESSAGES, 'CREATE TABLE topics(id, name, type, serialization_format)',
        'INSERT INTO topics VALUES (1, 2, 3, 4)',
    ],
}  # fmt: skip


@pytest.mark.parametrize('statements', HOSTILE.values(), ids=HOSTILE)
def test_a_database_that_is_no_recording_is_refused(statements, tmp_path):
    path = database_of(tmp_path / 'x.db3', *statements)
    with pytest.raises(ConfigError) as refused:
        read(path)
    assert str(refused.value).startswith(str(path))
    assert '\n' not in str(refused.value)


def test_more_topics_than_a_graph_has_are_refused(tmp_path):
    topics = [(f'/t{n}', FLOAT, 'cdr') for n in range(1001)]
    with pytest.raises(ConfigError, match='more than 1000 topics'):
        Recording(write_db3(tmp_path / 'x.db3', topics))


def test_a_tree_of_pages_that_repeats_itself_comes_to_an_end(tmp_path, monkeypatch):
    """Each page of the tree names the same child many times: rows without end, in a small file."""
    monkeypatch.setattr(db3_file, '_STEPS_AT_LEAST', 10**6)
    rows = [(1, n, bytes(300)) for n in range(2000)]
    path = write_db3(tmp_path / 'x.db3', rows=rows, indexed=False)
    data = bytearray(path.read_bytes())
    page = int.from_bytes(data[16:18], 'big')
    with closing(sqlite3.connect(path)) as database:
        (root,) = database.execute(
            "SELECT rootpage FROM sqlite_master WHERE name = 'messages'"
        ).fetchone()
    start = (root - 1) * page
    assert data[start] == 5  # an inner page of a table
    inner = bytes(data[start : start + page])
    cells = int.from_bytes(inner[3:5], 'big')
    pointers = [int.from_bytes(inner[12 + 2 * n : 14 + 2 * n], 'big') for n in range(cells)]
    children = [int.from_bytes(inner[place : place + 4], 'big') for place in pointers[:16]]
    for number, child in zip([root, *children], children, strict=False):
        level = bytearray(inner)
        for place in (8, *pointers):
            level[place : place + 4] = child.to_bytes(4, 'big')
        data[(number - 1) * page : number * page] = level
    path.write_bytes(data)
    with pytest.raises(ConfigError, match='does not come to an end') as refused:
        read(path)
    assert '\n' not in str(refused.value)


def test_sqlite_gets_no_more_steps_than_the_file_can_need(tmp_path, monkeypatch):
    monkeypatch.setattr(db3_file, '_STEPS_AT_LEAST', 0)
    monkeypatch.setattr(db3_file, '_STEPS_PER_BYTE', 0)
    monkeypatch.setattr(db3_file, '_STEPS_PER_CALL', 10)
    path = write_db3(tmp_path / 'x.db3')
    with pytest.raises(ConfigError, match='does not come to an end'):
        read(path)


def test_a_damaged_file_ends_in_one_sentence(tmp_path, capsys):
    """Every third byte in turn: the messages that come are at most those that were there."""
    whole = write_db3(tmp_path / 'x.db3').read_bytes()
    path = tmp_path / 'y.db3'
    refused = 0
    for position in range(0, len(whole), 97):
        damaged = bytearray(whole)
        damaged[position] ^= 0xFF
        path.write_bytes(damaged)
        try:
            read(path)
        except ConfigError as error:
            refused += 1
            [sentence] = str(error).splitlines()
            assert sentence.startswith(str(path))
    assert 0 < refused < len(whole) / 97 / 2
    capsys.readouterr()


@pytest.mark.parametrize('share', [0.1, 0.5, 0.9])
def test_a_file_that_was_cut_short_names_the_repair(share, tmp_path):
    path = write_db3(tmp_path / 'x.db3', rows=[(1, n, bytes(300)) for n in range(1000)])
    with path.open('r+b') as file:
        file.truncate(int(share * path.stat().st_size))
    with pytest.raises(ConfigError, match=r'malformed; `sqlite3 FILE\.db3 \.recover'):
        read(path)


def test_an_index_that_is_not_used_for_order_is_no_obstacle(tmp_path):
    path = write_db3(tmp_path / 'x.db3', indexed=False)
    database_of(path, INDEX.replace('timestamp ASC', 'topic_id'))
    assert read(path) == RATES
