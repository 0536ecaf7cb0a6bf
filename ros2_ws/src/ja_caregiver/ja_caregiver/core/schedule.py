"""A schedule: when a person who is filmed looks at the camera, and when at which thing.

The file is a table (CSV, one line a segment, in the order of time), which a spreadsheet can edit:

    # view_deg: 70
    # offset_s: 0.0
    kind,camera_s,start_s,end_s,thing,u,v,things
    look,5.0,6.5,9.0,2,,,
    look,9.0,10.5,13.0,,0.31,0.62,
    rearrange,13.0,,28.0,,,,0.10 0.50;0.31 0.62;0.90 0.55

`look`: she looks at the camera from `camera_s` on, is asked at `start_s`, and looks at the thing
until `end_s` [s]. The thing is given by its number, or by its place `u`, `v` in the picture, as
shares of the picture's width and height from its upper left corner. `rearrange`: hands move the
things from `camera_s` to `end_s`. `things`: the places of all things from this line on, in the
order of their numbers. Where it is left out, things are the places of the looks of this
arrangement, numbered from left to right. Lines that begin with `#` hold settings of the film:
`view_deg`, how wide the camera sees [deg], and `offset_s`, where in the film the schedule's time
zero is [s]; other such lines are remarks.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ja_common.core.config import ConfigError
from ja_common.core.files import write_file
from ja_common.core.safe_files import read_text

Place = tuple[float, float]
"""Where something is in a picture: shares (u, v) of its width and height, 0-1."""

COLUMNS = ('kind', 'camera_s', 'start_s', 'end_s', 'thing', 'u', 'v', 'things')
MOST_SEGMENTS, MOST_THINGS, LATEST_S = 5000, 20, 86400.0
LEAD_S = 5.0
"""Time before the first look: three beeps, and a breath."""
CAMERA_S, LOOK_S, REARRANGE_S = 1.5, 2.5, 15.0
"""How long she looks at the camera and at a thing, and hands move the things, at a pace of 1."""

_SAME_PLACE = 0.03
_SETTING = re.compile(r'#\s*(view_deg|offset_s)\s*:\s*(\S+)\s*$')
_VIEW_DEG = (10.0, 170.0)


@dataclass(frozen=True)
class ScheduledLook:
    """One request: a look at the camera from `camera_s`, at thing number `thing` from `start_s`.

    `things`: the places of all things, number 1 first; () where they are not known.
    """

    camera_s: float
    start_s: float
    end_s: float
    thing: int
    things: tuple[Place, ...] = ()


@dataclass(frozen=True)
class Rearrangement:
    """Hands move the things from `start_s` to `end_s` [s]."""

    start_s: float
    end_s: float


Segment = ScheduledLook | Rearrangement


@dataclass(frozen=True)
class Schedule:
    """Looks and rearrangements in the order of time, and what the film's camera is like.

    `view_deg`: its horizontal view, None where the file does not state it. `offset_s`: time in the
    film at which the schedule's time zero is.
    """

    segments: tuple[Segment, ...]
    view_deg: float | None = None
    offset_s: float = 0.0

    @property
    def looks(self) -> tuple[ScheduledLook, ...]:
        """Return the looks alone."""
        return tuple(each for each in self.segments if isinstance(each, ScheduledLook))

    @property
    def things(self) -> int:
        """Return how many things there are at most."""
        return max(max(len(each.things), each.thing) for each in self.looks)

    @property
    def end_s(self) -> float:
        """Return the time of the schedule at which its last segment ends."""
        return self.segments[-1].end_s

    def check_places(self, where: str) -> None:
        """Raise ConfigError where it is not known where the things are in the picture."""
        for index, look in enumerate(self.looks, 1):
            if not look.things:
                raise ConfigError(
                    f'{where}: look {index} gives thing {look.thing} by its number only: write '
                    'the places of all things into the column things ("u v;u v;..."), or its own '
                    'place into u and v'
                )


def make_schedule(
    seed: int,
    trials: int,
    things: int,
    pace: float = 1.0,
    rearrange_every: int = 5,
    rearrange_s: float = REARRANGE_S,
) -> Schedule:
    """Draw a schedule: never the same thing twice in turn; things are moved every few looks.

    `pace`: 2 is twice as fast. `rearrange_every`: 0 for never; but where things never move, no
    learner without labels can find out which of them she looks at. `rearrange_s`: how long hands
    move them, at a pace of 1 [s]. Raises ConfigError.
    """
    if not 1 <= trials <= MOST_SEGMENTS // 2 or not 1 <= things <= MOST_THINGS:
        raise ConfigError(
            f'a schedule has 1 to {MOST_SEGMENTS // 2} trials and 1 to {MOST_THINGS} things, '
            f'not {trials} and {things}'
        )
    if not (math.isfinite(pace) and 0.2 <= pace <= 5.0):
        raise ConfigError(f'pace = {pace} is outside [0.2, 5]')
    if rearrange_every < 0:
        raise ConfigError(f'rearrange_every = {rearrange_every} must not be negative')
    rng = np.random.default_rng(seed)
    segments: list[Segment] = []
    now_s, asked = LEAD_S, 0
    for trial in range(trials):
        if rearrange_every and trial and trial % rearrange_every == 0:
            segments.append(Rearrangement(now_s, _rounded(now_s + rearrange_s / pace)))
            now_s = segments[-1].end_s
        others = [each for each in range(1, things + 1) if each != asked]
        asked = int(rng.choice(others or [1]))
        start_s = _rounded(now_s + CAMERA_S / pace)
        segments.append(ScheduledLook(now_s, start_s, _rounded(start_s + LOOK_S / pace), asked))
        now_s = segments[-1].end_s
    return Schedule(tuple(segments))


def load_schedule(path: Path) -> Schedule:
    """Read a schedule. Raises ConfigError that names the file, the line and the mistake."""
    return parse_schedule(read_text(path), str(path))


def parse_schedule(text: str, where: str) -> Schedule:
    """Read a schedule from the text of its file; `where` it is from begins a ConfigError."""
    settings: dict[str, float] = {}
    header: list[str] | None = None
    rows: list[_Row] = []
    for number, line in enumerate(text.splitlines(), 1):
        at = f'{where}:{number}'
        if line.startswith('#'):
            if found := _SETTING.match(line):
                settings[found[1]] = _number(at, found[1], found[2], -LATEST_S, LATEST_S)
            continue
        cells = _cells(at, line)
        if not any(cells):
            continue
        if header is None:
            header = _header(at, cells)
            continue
        if len(cells) > len(header):
            raise ConfigError(f'{at}: {len(cells)} values for {len(header)} columns')
        rows.append(_Row(at, dict(zip(header, cells, strict=False))))
        if len(rows) > MOST_SEGMENTS:
            raise ConfigError(f'{where}: more than {MOST_SEGMENTS} segments')
    segments = _segments(rows)
    if not any(isinstance(each, ScheduledLook) for each in segments):
        raise ConfigError(f'{where}: no look: a schedule has at least one line "look,..."')
    view = settings.get('view_deg')
    if view is not None and not _VIEW_DEG[0] <= view <= _VIEW_DEG[1]:
        raise ConfigError(f'{where}: view_deg = {view:g} is outside {list(_VIEW_DEG)}')
    return Schedule(segments, view, settings.get('offset_s', 0.0))


def format_schedule(schedule: Schedule) -> str:
    """Return the text of a schedule's file."""
    lines = [] if schedule.view_deg is None else [f'# view_deg: {schedule.view_deg:g}']
    lines.append(f'# offset_s: {schedule.offset_s:g}')
    lines.append(','.join(COLUMNS))
    known: tuple[Place, ...] = ()
    for each in schedule.segments:
        if isinstance(each, Rearrangement):
            lines.append(f'rearrange,{each.start_s:.3f},,{each.end_s:.3f},,,,')
            continue
        places = ';'.join(f'{u:.5f} {v:.5f}' for u, v in each.things)
        things, known = ('' if each.things == known else places), each.things
        times = ','.join(f'{time:.3f}' for time in (each.camera_s, each.start_s, each.end_s))
        lines.append(f'look,{times},{each.thing},,,{things}')
    return '\n'.join(lines) + '\n'


def save_schedule(schedule: Schedule, path: Path) -> None:
    """Write a schedule's file. Raises SaveError."""
    write_file(path, format_schedule(schedule))


@dataclass(frozen=True)
class _Row:
    """One line of the table: where it stands, and its cells by column."""

    at: str
    cells: dict[str, str]

    def text(self, column: str) -> str:
        return self.cells.get(column, '')

    def number(self, column: str, low: float, high: float) -> float:
        return _number(self.at, column, self.text(column), low, high)

    def time(self, column: str) -> float:
        return self.number(column, 0.0, LATEST_S)


def _segments(rows: Sequence[_Row]) -> tuple[Segment, ...]:
    """Return the segments; places of things are those of the line, or of a line before."""
    segments: list[Segment] = []
    groups: list[list[tuple[int, _Row]]] = [[]]
    end_s = 0.0
    for row in rows:
        kind = row.text('kind')
        if kind not in ('look', 'rearrange'):
            raise ConfigError(f"{row.at}: kind is 'look' or 'rearrange', not {kind[:50]!r}")
        begin_s, until_s = row.time('camera_s'), row.time('end_s')
        if begin_s < end_s - 1e-6:
            raise ConfigError(
                f'{row.at}: camera_s = {begin_s:g} lies before the end of the segment above, '
                f'{end_s:g}'
            )
        end_s = until_s
        if row.text('things') or kind == 'rearrange':
            groups.append([])
        if kind == 'rearrange':
            _check_order(row, begin_s, until_s)
            segments.append(Rearrangement(begin_s, until_s))
            if row.text('things'):
                groups[-1].append((-1, row))
            continue
        start_s = row.time('start_s')
        _check_order(row, begin_s, start_s, until_s)
        groups[-1].append((len(segments), row))
        segments.append(ScheduledLook(begin_s, start_s, until_s, 0))
    for group in groups:
        if group:
            _number_things(group, segments)
    return tuple(segments)


def _check_order(row: _Row, *times: float) -> None:
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise ConfigError(f'{row.at}: camera_s, start_s and end_s must increase')


def _number_things(group: Sequence[tuple[int, _Row]], segments: list[Segment]) -> None:
    """Give the looks of one arrangement the number of their thing, and the places of all."""
    things = _listed(group[0][1])
    looks = [(index, row, _place(row)) for index, row in group if index >= 0]
    if not things:
        things = _distinct(place for _, _, place in looks if place is not None)
    for index, row, place in looks:
        if place is None:
            thing = int(row.number('thing', 1, MOST_THINGS))
            if row.number('thing', 1, MOST_THINGS) != thing:
                raise ConfigError(f'{row.at}: thing = {row.text("thing")} is no whole number')
            if things and thing > len(things):
                raise ConfigError(f'{row.at}: thing {thing} of only {len(things)} places')
        else:
            thing = 1 + min(range(len(things)), key=lambda at: math.dist(things[at], place))
        look = segments[index]
        assert isinstance(look, ScheduledLook)
        segments[index] = replace(look, thing=thing, things=things)


def _listed(row: _Row) -> tuple[Place, ...]:
    """Return the places in the column `things`."""
    text = row.text('things')
    if not text:
        return ()
    places: list[Place] = []
    for number, pair in enumerate(text.split(';'), 1):
        values = pair.split()
        if len(values) != 2:
            raise ConfigError(
                f'{row.at}: thing {number} in the column things is {pair[:50]!r}; write u and v '
                'with a space between them, and ; between two things'
            )
        u, v = (_number(row.at, f'thing {number}', value, 0.0, 1.0) for value in values)
        places.append((u, v))
    if len(places) > MOST_THINGS:
        raise ConfigError(f'{row.at}: {len(places)} things; at most {MOST_THINGS} are read')
    return tuple(places)


def _place(row: _Row) -> Place | None:
    """Return the place of a look's thing in the columns u and v; None where it has a number."""
    given = [bool(row.text(column)) for column in ('u', 'v')]
    if any(given) == bool(row.text('thing')) or any(given) != all(given):
        raise ConfigError(f'{row.at}: a look has a thing, or u and v: one of both')
    return (row.number('u', 0.0, 1.0), row.number('v', 0.0, 1.0)) if all(given) else None


def _distinct(places: Iterable[Place]) -> tuple[Place, ...]:
    """Return places that are not one and the same, from left to right."""
    known: list[Place] = []
    for place in places:
        if all(math.dist(place, other) > _SAME_PLACE for other in known):
            known.append(place)
    return tuple(sorted(known))


def _header(at: str, cells: list[str]) -> list[str]:
    missing = {'kind', 'camera_s', 'start_s', 'end_s'} - {*cells}
    unknown = [cell for cell in cells if cell not in COLUMNS]
    if missing or unknown or len({*cells}) < len(cells):
        raise ConfigError(
            f'{at}: the first line names the columns {",".join(COLUMNS)}, each once; '
            f'found {",".join(cells)[:100]!r}'
        )
    return cells


def _cells(at: str, line: str) -> list[str]:
    try:
        rows = list(csv.reader([line], strict=True))
    except csv.Error as error:
        raise ConfigError(f'{at}: no line of a table (CSV): {error}') from None
    return [cell.strip() for cell in rows[0]] if rows else []


def _number(at: str, name: str, text: str, low: float, high: float) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ConfigError(f'{at}: {name} = {text[:50]!r} is no number') from None
    if not low <= value <= high:  # NaN is neither
        raise ConfigError(f'{at}: {name} = {text[:50]} is outside [{low:g}, {high:g}]')
    return value


def _rounded(time_s: float) -> float:
    return round(time_s, 3)
