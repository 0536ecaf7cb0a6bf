"""A meeting with a film of a person who follows a schedule, and what is needed to make one."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ja_bringup.meet import run_meeting
from ja_caregiver.core.film_clips import FilmFacts, Picture, film_facts
from ja_caregiver.core.rehearsal import RehearsalConfig, film_rehearsal
from ja_caregiver.core.schedule import Rearrangement, Schedule, load_schedule, save_schedule
from ja_caregiver.core.spoken_schedule import save_page, save_sound
from ja_caregiver.core.thing_places import draw_places, place_things
from ja_common.core.config import ConfigError
from ja_common.core.run_folder import new_run_folder
from ja_runner.graph import RECORDER, film_graph, replace_nodes, with_arguments
from ja_runner.node_spec import NodeSpec
from ja_runner.senses import with_senses
from ja_runner.supervisor import DEFAULT, Supervision

SCHEDULE_FILE = 'schedule.csv'
REHEARSAL_SEED = 1000
"""The first seed of the worlds of rehearsals: not those of the demo and of the benchmarks."""
REHEARSAL_HANDS_S = 1.0
"""The simulator needs no hands to move things."""
USUAL_VIEW_DEG = 65.0
"""Horizontal view of the camera of a phone that films in landscape, where nothing is stated."""
_TURNS_S = 0.3
_LEAST_SHOWN_S, _MOST_SHOWN_S = 0.6, 10.0
_DWELLS_ON_S = 0.2
_LEARNER = 'gaze_line'


def run_film_meeting(
    film: Path,
    schedule: Path,
    *,
    seed: int = 0,
    offset_s: float = 0.0,
    view_deg: float | None = None,
    senses: Sequence[str] = (),
    swap: Sequence[str] = (),
    record: bool = False,
    one_process: bool = False,
    view: bool = True,
    markers: bool = False,
    supervision: Supervision = DEFAULT,
    arguments: Sequence[str] = (),
    resume: Path | None = None,
) -> int:
    """Run a meeting with a film, and print its figures; return the exit code, as `run_meeting`.

    `offset_s`: where in the film the schedule's time zero is, beside the schedule's own offset.
    `view_deg`: horizontal view of the camera that filmed; by default that of the schedule. Raises
    ConfigError for a film or schedule that cannot be used.
    """
    plan, facts = load_schedule(schedule), film_facts(film)
    check_length(plan, facts, offset_s)
    known = view_deg or plan.view_deg or USUAL_VIEW_DEG
    if view_deg is None and plan.view_deg is None:
        print(f'the view of the camera is taken to be {known:g} degrees; --view-deg changes it')
    folder = new_run_folder('meet').absolute()
    if not all(look.things for look in plan.looks):
        plan = find_places(plan, film, offset_s, known, folder)
        schedule = folder / SCHEDULE_FILE
    parameters = {
        'film': str(film.absolute()),
        'schedule': str(schedule.absolute()),
        'offset_s': offset_s,
        'folder': str(folder),
        'learner': _LEARNER,
        'wide_view_rad': math.radians(known),
    }
    graph = with_senses(make_film_graph(plan, facts, parameters, seed), senses)
    return run_meeting(
        with_arguments([*[RECORDER] * record, *replace_nodes(graph, swap)], arguments),
        folder,
        one_process=one_process,
        view=view,
        markers=markers,
        supervision=supervision,
        arguments=arguments,
        resume=resume,
    )


def find_places(
    schedule: Schedule, film: Path, offset_s: float, view_deg: float, folder: Path
) -> Schedule:
    """Find where the things of a film are; save the schedule with them, and pictures to check.

    Raises ConfigError where fewer things are found than the schedule names.
    """
    capture = cv2.VideoCapture(str(film))

    def picture_at(time_s: float) -> Picture | None:
        seconds = time_s + schedule.offset_s + offset_s
        if seconds < 0 or not capture.set(cv2.CAP_PROP_POS_MSEC, 1000 * seconds):
            return None
        got, picture = capture.read()
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8) if got else None

    try:
        placed, found = place_things(schedule, picture_at, math.radians(view_deg))
    finally:
        capture.release()
    known = tuple(
        each for each in placed.segments if isinstance(each, Rearrangement) or each.things
    )
    placed = replace(placed, segments=known)  # what the film does not show has no places
    save_schedule(placed, folder / SCHEDULE_FILE)
    for number, each in enumerate(found, 1):
        picture = cv2.cvtColor(draw_places(each), cv2.COLOR_RGB2BGR)
        cv2.imwrite(str(folder / f'things_{number:02}.jpg'), picture)
    print(
        f'the things were found in {len(found)} arrangements, numbered from left to right: '
        f'compare {folder / "things_01.jpg"} and those beside it, and correct '
        f'{folder / SCHEDULE_FILE} if they are wrong'
    )
    return placed


def write_spoken_schedule(schedule: Schedule, folder: Path) -> list[Path]:
    """Write a schedule, the page that speaks it and its beeps; return the files. SaveError."""
    files = [folder / name for name in (SCHEDULE_FILE, 'schedule.html', 'schedule.wav')]
    for path, save in zip(files, (save_schedule, save_page, save_sound), strict=True):
        save(schedule, path)
    return files


def write_rehearsal(schedule: Schedule, film: Path, seed: int) -> Path:
    """Film the simulated caregiver by a schedule; return the file of the schedule beside the film.

    Raises ConfigError and SaveError.
    """
    shown = [-1]

    def progress(share: float) -> None:
        tenths = int(10 * share)
        if tenths > shown[0]:
            shown[0] = tenths
            print(f'filmed: {10 * tenths} %', flush=True)

    config = RehearsalConfig(seed=REHEARSAL_SEED + seed)
    path = film.with_suffix('.csv')
    save_schedule(film_rehearsal(schedule, film, config, progress), path)
    return path


def make_film_graph(
    schedule: Schedule, facts: FilmFacts, parameters: Mapping[str, Any], seed: int
) -> list[NodeSpec]:
    """Return the graph for a film: times that fit its looks, limits that fit its picture."""
    longest_s = max(look.end_s - look.start_s for look in schedule.looks) + _TURNS_S
    shown_s = round(float(np.clip(longest_s, _LEAST_SHOWN_S, _MOST_SHOWN_S)), 2)
    half = math.tan(parameters['wide_view_rad'] / 2)
    pan, tilt = math.atan(half), math.atan(half * facts.height / facts.width)
    gate = {
        'dwell_s': shown_s + _DWELLS_ON_S,
        'pan_min_rad': -pan,
        'pan_max_rad': pan,
        'tilt_min_rad': -tilt,
        'tilt_max_rad': tilt,
    }
    return [
        replace(spec, parameters={**spec.parameters, **gate})
        if spec.executable == 'gate'
        else spec
        for spec in film_graph({**parameters, 'shown_s': shown_s}, seed)
    ]


def check_length(schedule: Schedule, facts: FilmFacts, offset_s: float) -> None:
    """Print a warning where the film is shorter than the schedule.

    Raises ConfigError where not even the first look is in the film.
    """
    ends_s = [look.end_s + schedule.offset_s + offset_s for look in schedule.looks]
    fitting = sum(end_s <= facts.length_s for end_s in ends_s)
    if not fitting:
        raise ConfigError(
            f'the film lasts {facts.length_s:.1f} s, and its first look ends at {ends_s[0]:.1f} s:'
            ' is it the film of this schedule, and is --offset right?'
        )
    if fitting < len(ends_s):
        print(
            f'warning: the film lasts {facts.length_s:.1f} s: only the first {fitting} of '
            f'{len(ends_s)} looks are in it'
        )
