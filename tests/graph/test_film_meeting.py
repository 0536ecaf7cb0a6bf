"""A film with a schedule, from the simulator to the report: the whole way without a person."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from ja_bringup.meet_film import run_film_meeting
from ja_caregiver.core.meeting import Meeting, load_meeting
from ja_caregiver.core.rehearsal import RehearsalConfig, film_rehearsal
from ja_caregiver.core.schedule import (
    Rearrangement,
    Schedule,
    ScheduledLook,
    make_schedule,
    save_schedule,
)
from ja_common.topics import CAREGIVER_REQUEST
from ja_runner.graph import film_graph

PLAN = Schedule(
    (
        ScheduledLook(0.2, 0.6, 1.5, 1),
        ScheduledLook(1.5, 2.1, 3.0, 3),
        Rearrangement(3.0, 3.6),
        ScheduledLook(3.6, 4.2, 5.1, 2),
    )
)


def meet(film: Path, seed: int = 0, one_process: bool = True, **options) -> Meeting:
    """Run a meeting with a film in the current folder, and return it."""
    before = {*Path('runs').glob('*-meet')}
    code = run_film_meeting(
        film, film.with_suffix('.csv'), seed=seed, one_process=one_process, view=False, **options
    )
    assert code == 0
    (folder,) = {*Path('runs').glob('*-meet')} - before
    assert (folder / 'report.html').exists()
    return load_meeting(folder / 'meeting.json')


def test_a_short_film_goes_the_whole_way_twice_alike(domain, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    film = tmp_path / 'film.avi'
    small = RehearsalConfig(width=480, height=270)
    save_schedule(film_rehearsal(PLAN, film, small), film.with_suffix('.csv'))
    first, again = meet(film), meet(film)
    assert [trial.asked for trial in first.trials] == [look.thing for look in PLAN.looks]
    assert first.ended == 'all requests were made'
    assert all(trial.face_picture for trial in first.trials), 'she was looked at'
    assert all(trial.proposed or trial.fixated for trial in first.trials)
    stamps = [trial.stamp_ns for trial in first.trials]
    assert all(later > earlier for earlier, later in pairwise(stamps))
    assert replace(again, started=first.started) == first
    assert '3 requests' in capsys.readouterr().out


def test_no_node_of_the_robot_subscribes_to_what_she_is_asked(ros_context, tmp_path):
    nodes = [
        spec.load()(context=ros_context, cli_args=spec.ros_arguments())
        for spec in film_graph({})
        if spec.executable != 'film_session'  # which publishes it
    ]
    topics = {
        topic
        for node in nodes
        for topic, _ in node.get_subscriber_names_and_types_by_node(
            node.get_name(), node.get_namespace()
        )
    }
    for node in nodes:
        node.destroy_node()
    assert topics
    assert not any(topic.startswith('/caregiver/') for topic in topics)
    assert CAREGIVER_REQUEST.name.startswith('caregiver/')


@pytest.mark.learning
@pytest.mark.parametrize(('senses', 'reached'), [((), 0.75), (('eyes',), 0.8)])
def test_in_a_long_rehearsal_the_learner_reaches_what_it_reaches_in_the_demo(
    senses, reached, domain, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    film = tmp_path / 'film.mp4'
    plan = make_schedule(3, 120, 5, pace=2.0, rearrange_s=2.0)
    save_schedule(film_rehearsal(plan, film), film.with_suffix('.csv'))
    meeting = meet(film, one_process=False, senses=senses)
    last = meeting.learner_rate(slice(-50, None))
    print(f'\nlearner alone, last 50: {last}')
    assert last.rate >= reached
    assert last.interval[0] > 0.4, 'chance is 0.2'
