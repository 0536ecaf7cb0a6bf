"""`./ja meet`: its options, when it ends, and what it prints then."""

import sys
from types import ModuleType

import pytest
from typer.testing import CliRunner

from ja_bringup import meet
from ja_bringup.cli import app
from ja_bringup.meet import MeetingWatch, print_end, source_kind, summary
from ja_caregiver.core.meeting import Meeting, MeetingTrial, save_meeting
from ja_common.core.config import ConfigError
from ja_common.core.files import SaveError

THINGS = {1: (0.1, 0.1), 2: (-0.1, 0.1)}
TRIALS = (
    MeetingTrial(1, 0, 1, THINGS, 1, 1, True),
    MeetingTrial(2, 0, 2, THINGS, 2, 1, False),
    MeetingTrial(3, 0, 1, THINGS),
)
MEETING = Meeting('2026-01-02T03:04:05', 'webcam', 0, 'gaze_line', 'strict', '', TRIALS)


@pytest.mark.parametrize(
    ('arguments', 'sentence'),
    [
        (['--pace', '0'], '--pace'),
        (['--pace', '9'], '--pace'),
        (['--trials', '0'], '--trials'),
        (['--rearrange-every', '-1'], '--rearrange-every'),
        (['film.mp4'], '--schedule'),
        (['film.mp4', '--schedule', 's.csv', '--source', '0'], 'takes the place of --source'),
        (['--schedule', 's.csv'], 'is for a film'),
    ],
)
def test_bad_options_are_refused_before_anything_starts(
    arguments, sentence, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    done = CliRunner(env={'COLUMNS': '300'}).invoke(app, ['meet', *arguments])
    assert done.exit_code == 2
    assert sentence in done.output
    assert not (tmp_path / 'runs').exists()


@pytest.mark.parametrize(
    ('arguments', 'sentence'),
    [
        (['--resume', 'nowhere'], 'nowhere cannot be resumed'),
        (['--senses', 'smell'], "'smell' is no sense"),
        (['--swap', 'gaet=a/b'], "no node 'gaet'"),
    ],
)
def test_settings_that_cannot_be_used_are_one_sentence(arguments, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ['meet', *arguments])
    assert isinstance(done.exception, ConfigError)
    assert sentence in str(done.exception)


def test_the_source_is_noted(tmp_path):
    clip = tmp_path / 'clip.mp4'
    clip.touch()
    assert [source_kind(each) for each in (None, '0', 'rtsp://camera', str(clip))] == [
        'topics', 'webcam', 'webcam', 'film'
    ]  # fmt: skip


def test_the_graph_ends_some_time_after_the_meeting(tmp_path):
    watch = MeetingWatch(tmp_path, shown_s=10.0)
    assert not watch.is_over(0.0)
    (tmp_path / 'meeting.json').write_text('half a fi')
    assert not watch.is_over(1.0)
    save_meeting(MEETING, tmp_path)
    assert not watch.is_over(2.0)
    save_meeting(Meeting('x', 'webcam', 0, ended='all requests were made'), tmp_path)
    assert not watch.is_over(2.2)  # the file is read twice a second
    assert not watch.is_over(3.0)
    assert not watch.is_over(12.9)
    assert watch.is_over(13.0)


def test_summary():
    assert summary(MEETING) == [
        '3 requests; the head followed the learner 1 times',
        'success, learner alone: 1.00 [0.34, 1.00] of 2',
        'success of the head:    0.33 [0.06, 0.79] of 3',
        'chance, one thing of those there: 0.50',
        'missed: 2 (thing 2), 3 (thing 1)',
        'track of the learner: strict',
    ]


@pytest.fixture
def report(monkeypatch):
    """Put a writer of reports in the place of ours; return what it does."""
    module = ModuleType('report')
    monkeypatch.setitem(sys.modules, 'ja_caregiver.core.report', module)
    module.write_report = lambda meeting, folder: folder / 'report.html'
    return module


def test_the_end_prints_figures_and_the_report(tmp_path, report, capsys):
    save_meeting(MEETING, tmp_path)
    assert print_end(tmp_path, 0) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:-1] == summary(MEETING)
    assert lines[-1] == f'report: {tmp_path}/report.html'


def test_a_report_that_cannot_be_written_is_an_error_after_the_figures(tmp_path, report, capsys):
    def fail(meeting, folder):
        raise SaveError('report.html cannot be written (No space left): make room on its disk')

    report.write_report = fail
    save_meeting(MEETING, tmp_path)
    assert print_end(tmp_path, 0) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[:-1] == summary(MEETING)
    assert lines[-1].startswith('error: report.html cannot be written')


@pytest.mark.parametrize('trials', [None, ()])
def test_a_meeting_without_answers_has_no_figures(tmp_path, trials, report, capsys):
    if trials is not None:
        save_meeting(Meeting('x', 'webcam', 0, ended='stopped'), tmp_path)
    assert print_end(tmp_path, 0) == 1
    assert print_end(tmp_path, 2) == 2
    assert capsys.readouterr().out.splitlines()[0] == 'no request was answered'


def test_a_film_is_handed_over_with_all_its_options(monkeypatch):
    given = {}

    def run_film_meeting(film, schedule, **options):
        given.update(options, film=str(film), schedule=str(schedule))
        return 0

    module = ModuleType('ja_bringup.meet_film')
    module.run_film_meeting = run_film_meeting
    monkeypatch.setitem(sys.modules, 'ja_bringup.meet_film', module)
    monkeypatch.setattr(meet, 'run_meeting', lambda *_, **__: pytest.fail('no camera'))
    words = ['meet', 'me.mp4', '--schedule', 'me.csv', '--seed', '4', '--senses', 'eyes']
    assert CliRunner().invoke(app, [*words, '--no-view']).exit_code == 0
    assert (given['film'], given['schedule']) == ('me.mp4', 'me.csv')
    assert (given['seed'], given['senses'], given['view']) == (4, ['eyes'], False)
