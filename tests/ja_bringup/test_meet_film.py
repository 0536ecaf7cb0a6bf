"""The command of a film: lengths, limits, places of things, and the files of a schedule."""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from ja_bringup.cli import app
from ja_bringup.meet_film import (
    check_length,
    find_places,
    make_film_graph,
    run_film_meeting,
    write_rehearsal,
)
from ja_caregiver.core.film_clips import FilmFacts
from ja_caregiver.core.schedule import (
    Schedule,
    ScheduledLook,
    load_schedule,
    make_schedule,
    save_schedule,
)
from ja_common.core.config import ConfigError

PLAN = make_schedule(0, 4, 3, 2.0, 2, 1.0)
FACTS = FilmFacts(1280, 720, 60.0)


def ja(*arguments: str) -> tuple[int, str]:
    """Run a command; return its exit code and its output, or the sentence of its error."""
    result = CliRunner().invoke(app, list(arguments))
    sentence = str(result.exception) if isinstance(result.exception, ConfigError) else ''
    return result.exit_code, result.output + sentence


def test_a_film_that_holds_no_look_is_refused():
    with pytest.raises(ConfigError, match=r'the film lasts 3\.0 s, and its first look ends at 7'):
        check_length(PLAN, replace(FACTS, length_s=3.0), 0.0)
    with pytest.raises(ConfigError, match='is --offset right'):
        check_length(PLAN, FACTS, 100.0)


def test_a_film_that_ends_early_is_a_warning(capsys):
    check_length(PLAN, replace(FACTS, length_s=9.5), 0.0)
    assert 'only the first 2 of 4 looks' in capsys.readouterr().out
    check_length(PLAN, replace(FACTS, length_s=math.inf), 0.0)
    assert not capsys.readouterr().out


def test_the_gate_looks_for_as_long_as_a_look_is_shown_and_stays_in_the_film():
    graph = make_film_graph(PLAN, FACTS, {'wide_view_rad': math.radians(70)}, seed=7)
    nodes = {spec.executable: spec.parameters for spec in graph}
    assert {'film_session', 'gate', 'learning_module'} <= nodes.keys()
    assert nodes['film_session']['shown_s'] == pytest.approx(1.25 + 0.3)
    assert nodes['gate']['dwell_s'] == pytest.approx(nodes['film_session']['shown_s'] + 0.2)
    assert nodes['gate']['pan_max_rad'] == pytest.approx(math.radians(35))
    assert nodes['gate']['tilt_min_rad'] == pytest.approx(-0.375, abs=0.005)
    assert all(nodes[name]['use_sim_time'] for name in nodes)
    assert nodes['gate']['lockstep']
    assert nodes['learning_module']['seed'] == 7


def film_of_things(path: Path) -> None:
    """Write a film of three bright discs that stand elsewhere in its second half."""
    size = (640, 360)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*'MJPG'), 10.0, size)
    colours = [(0, 0, 255), (255, 0, 0), (0, 200, 0)]
    for number in range(130):
        picture = np.full((360, 640, 3), 150, np.uint8)
        shift = 60 if number > 95 else 0
        for place, colour in zip((100, 320, 500), colours, strict=True):
            cv2.circle(picture, (place + shift, 240), 16, colour, -1)
        writer.write(picture)
    writer.release()


def test_things_of_numbers_are_found_and_pictures_show_them(tmp_path: Path, capsys):
    film = tmp_path / 'film.avi'
    film_of_things(film)
    placed = find_places(PLAN, film, 0.0, 65.0, tmp_path)
    assert load_schedule(tmp_path / 'schedule.csv').looks == tuple(
        replace(look, things=tuple((round(u, 5), round(v, 5)) for u, v in look.things))
        for look in placed.looks
    )
    for look, lefts in zip(
        placed.looks, [(100, 320, 500)] * 2 + [(160, 380, 560)] * 2, strict=True
    ):
        assert [u * 640 for u, _ in look.things] == pytest.approx(lefts, abs=4)
    assert {path.name for path in tmp_path.glob('*.jpg')} == {'things_01.jpg', 'things_02.jpg'}
    assert 'from left to right' in capsys.readouterr().out


def test_too_few_things_and_bad_files_are_refused(tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    film = tmp_path / 'film.avi'
    film_of_things(film)
    plan = Schedule((ScheduledLook(1.0, 2.0, 3.0, 9),))
    save_schedule(plan, tmp_path / 'plan.csv')
    with pytest.raises(ConfigError, match='only 3 of 9 things'):
        run_film_meeting(film, tmp_path / 'plan.csv')
    with pytest.raises(ConfigError, match='no such film'):
        run_film_meeting(tmp_path / 'other.mp4', tmp_path / 'plan.csv')
    with pytest.raises(ConfigError, match='no such file'):
        run_film_meeting(film, tmp_path / 'other.csv')


def test_a_schedule_is_written_as_table_page_and_sound(tmp_path: Path):
    code, output = ja(
        'meet', '--make-schedule', str(tmp_path / 'out'), '--trials', '6', '--things', '3'
    )
    assert code == 0
    written = {path.name for path in (tmp_path / 'out').iterdir()}
    assert written == {'schedule.csv', 'schedule.html', 'schedule.wav'}
    assert len(load_schedule(tmp_path / 'out' / 'schedule.csv').looks) == 6
    assert all(name in output for name in written)


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        (['film.mp4'], 'needs --schedule'),
        (['--schedule', 'plan.csv'], 'is for a film'),
        (['film.mp4', '--schedule', 'plan.csv', '--source', '0'], 'one of the two'),
        (['--make-schedule', 'out', '--rehearse', 'film.mp4'], 'each stand alone'),
        (['--stills', 'out', '--source', '0'], 'each stand alone'),
        (['--make-schedule', 'out', '--things', '0'], 'things'),
        (['--rehearse', 'film.gif'], 'ends in .mp4 or .avi'),
        (['--stills', 'missing'], 'no such folder'),
        (['none.mp4', '--schedule', 'none.csv'], 'none.csv'),
    ],
)
def test_options_that_do_not_fit_are_refused(arguments, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, output = ja('meet', *arguments)
    assert code != 0
    assert text in ' '.join(output.split())


def test_a_rehearsal_lies_beside_its_schedule(tmp_path: Path, monkeypatch, capsys):
    filmed = []

    def film(schedule, path, config, progress):
        filmed.append((path, config.seed))
        progress(1.0)
        return schedule

    monkeypatch.setattr('ja_bringup.meet_film.film_rehearsal', film)
    path = write_rehearsal(PLAN, tmp_path / 'sim.mp4', seed=2)
    assert path == tmp_path / 'sim.csv'
    assert load_schedule(path) == PLAN
    assert filmed == [(tmp_path / 'sim.mp4', 1002)]
    assert 'filmed: 100 %' in capsys.readouterr().out
