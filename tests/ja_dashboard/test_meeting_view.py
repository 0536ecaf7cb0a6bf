"""What the page reads from the texts of the scorer, and where the numbers stand in the picture."""

import math
from itertools import pairwise

import numpy as np
import pytest

from fake_meeting import MEASURED, STATES, meeting
from ja_common.core.camera_model import CameraModel
from ja_common.core.lens import Lens
from ja_common.core.request_phase import RequestPhase
from ja_dashboard.core.meeting_view import (
    LearnerFigure,
    MeetingView,
    NumberedThing,
    marks_in_picture,
    report_file,
)

CAMERA = CameraModel.from_field_of_view(640, 480, math.radians(60))
ODD = ['', ' ', 'x', '-1', '1.5', 'nan', 'inf', '１', '1e3', '9' * 5000, '\0', 'None']


def test_all_that_the_scorer_states_is_read():
    view = meeting('wrong')
    assert (view.phase, view.number, view.answer, view.right) == (RequestPhase.ANSWER, 4, 2, False)
    assert (view.trial, view.trials, view.successes, view.chance) == (24, 40, 17, 0.2)
    assert view.learner == LearnerFigure(17, 23, (0.5353, 0.8745))
    assert view.things[1] == NumberedThing(2, (-0.03, 0.22))
    assert (view.message, view.film) == ('I looked at thing 2: wrong.', False)


@pytest.mark.parametrize('state', STATES)
def test_each_phase_is_known(state):
    assert meeting(state).phase is not RequestPhase.STARTING or state == 'starting'


def test_what_is_missing_is_none():
    assert MeetingView.of('', {}) == MeetingView()


@pytest.mark.parametrize('key', ['number', 'trial', 'trials', 'answer', 'successes'])
@pytest.mark.parametrize('text', ODD)
def test_an_odd_count_is_left_out_and_all_others_are_read(key, text):
    view = MeetingView.of('', MEASURED | {key: text})
    assert getattr(view, key) is None
    assert view.learner == meeting('thing').learner


@pytest.mark.parametrize(
    'values',
    [
        {'learner_trials': '0'},
        {'learner_trials': ''},
        {'learner_successes': '24'},
        {'learner_interval': ''},
        {'learner_interval': '0.2'},
        {'learner_interval': '0.9 0.1'},
        {'learner_interval': '0.1 nan'},
        {'learner_interval': '-1 2'},
        {'learner_interval': '0 1 2'},
    ],
)
def test_a_figure_that_is_none_is_left_out(values):
    assert MeetingView.of('', MEASURED | values).learner is None


@pytest.mark.parametrize(
    ('text', 'numbers'),
    [
        ('', []),
        (';;', []),
        ('1 0.1 0.2', [1]),
        ('1 0.1', []),
        ('1 0.1 nan;2 0 0;x 0 0;3 inf 0', [2]),
        ('1 0 0;1 1 1', [1]),
        ('1 0 0 and more', [1]),
        (';'.join(f'{n} 0 0' for n in range(500)), list(range(40))),
    ],
)
def test_things_are_read_as_far_as_they_go(text, numbers):
    view = MeetingView.of('', {'things': text})
    assert [thing.number for thing in view.things] == numbers


def test_odd_words_are_no_phase_and_no_verdict():
    view = MeetingView.of('m' * 9999, {'phase': '<b>', 'right': 'yes', 'chance': '2', 'film': 'x'})
    assert (view.phase, view.right, view.chance, view.film) == (
        RequestPhase.STARTING,
        None,
        None,
        False,
    )
    assert len(view.message) == 200


def test_a_meeting_is_silent_unless_it_has_ended():
    assert not meeting('thing').is_silent
    assert MeetingView(RequestPhase.THING, silent_s=9.0).is_silent
    assert not MeetingView(RequestPhase.ENDED, silent_s=9.0).is_silent


def marks(*directions, posture=(0.0, 0.0), camera=CAMERA):
    things = [NumberedThing(n, direction) for n, direction in enumerate(directions, 1)]
    return {mark.number: mark for mark in marks_in_picture(things, posture, camera)}


def test_a_number_stands_at_its_thing_through_the_present_posture():
    [centre] = marks((0.3, 0.1), posture=(0.3, 0.1)).values()
    assert (centre.x, centre.y) == pytest.approx((0.5, 0.5))
    [left] = marks((0.3 + math.radians(15), 0.0), posture=(0.3, 0.0)).values()
    assert left.x == pytest.approx(0.5 - 0.5 * math.tan(math.radians(15)) / math.tan(math.pi / 6))
    assert (left.y, left.outside) == (pytest.approx(0.5), False)
    [below] = marks((0.3, 0.2), posture=(0.3, 0.0)).values()
    assert below.y > 0.5, 'positive tilt is downwards'


@pytest.mark.parametrize(
    ('direction', 'place', 'angle_deg'),
    [
        ((1.0, 0.0), (0.06, 0.5), 180.0),
        ((-1.0, 0.0), (0.94, 0.5), 0.0),
        ((0.0, 0.9), (0.5, 0.94), 90.0),
        ((0.0, -0.9), (0.5, 0.06), -90.0),
        ((3.0, 0.0), (0.06, 0.5), 180.0),
        ((-3.0, 0.0), (0.94, 0.5), 0.0),
    ],
)
def test_a_thing_outside_the_picture_is_marked_at_the_edge(direction, place, angle_deg):
    [mark] = marks(direction).values()
    assert (mark.x, mark.y) == pytest.approx(place, abs=0.005)
    assert mark.outside
    assert math.remainder(mark.angle_deg - angle_deg, 360) == pytest.approx(0, abs=1)


def test_marks_at_one_edge_keep_apart_and_in_order():
    found = marks(*[(1.2, 0.01 * n) for n in range(6)])
    heights = [found[n].y for n in range(1, 7)]
    assert all(below - above > 0.12 for above, below in pairwise(heights))
    assert heights[0] >= 0.06 - 1e-9
    assert heights[-1] <= 0.94 + 1e-9
    crowded = marks(*[(1.2, 0.01 * n) for n in range(30)])
    assert all(0.05 < mark.y < 0.95 for mark in crowded.values())


def test_a_lens_that_folds_back_puts_no_thing_into_the_picture():
    """A polynomial lens is right in its picture only: beyond, far rays return to the middle."""
    folding = CameraModel(640, 480, 300, 300, 320, 240, Lens((-0.3, 0.0, 0.0, 0.0, 0.0)))
    assert folding.contains(folding.pixels([1.8, 0.0])), 'it folds'
    [mark] = marks((-math.atan(1.8), 0.0), camera=folding).values()
    assert mark.outside


def test_no_things_no_marks():
    assert marks() == {}


def test_every_mark_is_finite_wherever_the_thing_is():
    rng = np.random.default_rng(0)
    for direction in rng.uniform(-math.pi, math.pi, (200, 2)):
        [mark] = marks(tuple(direction), posture=rng.uniform(-1, 1, 2)).values()
        assert 0 <= mark.x <= 1
        assert 0 <= mark.y <= 1
        assert math.isfinite(mark.angle_deg)


@pytest.fixture
def report(tmp_path):
    folder = tmp_path / '20261130-200000-meet'
    folder.mkdir()
    (folder / 'meeting.json').touch()
    (folder / 'report.html').touch()
    return folder / 'report.html'


def test_only_the_report_of_a_meeting_is_served(report, monkeypatch):
    assert report_file(str(report)) == report
    monkeypatch.chdir(report.parents[1])
    assert report_file(f'{report.parent.name}/report.html') == report


def test_any_other_file_is_not_served(report, tmp_path):
    other = report.with_name('meeting.json')
    secret = tmp_path / 'secret'
    secret.touch()
    link = tmp_path / 'link-meet'
    link.mkdir()
    (link / 'meeting.json').touch()
    (link / 'report.html').symlink_to(secret)
    lonely = tmp_path / 'report.html'
    lonely.touch()
    for path in ('', 'a\0b', '/etc/passwd', other, report.parent, link / 'report.html', lonely,
                 tmp_path / 'gone' / 'report.html', 'x' * 9999):  # fmt: skip
        assert report_file(str(path)) is None
