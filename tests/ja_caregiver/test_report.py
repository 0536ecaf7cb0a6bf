"""The report of a meeting is one page that states what was measured, whatever the meeting was."""

import base64
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest

from ja_caregiver.core.meeting import Meeting, MeetingTrial, load_meeting, save_meeting
from ja_caregiver.core.report import (
    MOST_MISSED,
    compared_with_chance,
    missed_trials,
    report_html,
    write_report,
)
from ja_common.core.statistics import Rate

THINGS = {number: (0.1 * number, 0.0) for number in range(1, 6)}
_VOID = {'meta', 'img', 'br', 'link'}


def trial(number, asked=1, proposed=1, fixated=1, **more):
    return MeetingTrial(number, number * 10**9, asked, THINGS, proposed, fixated, **more)


def meeting(*trials, **more):
    kept = {'started': '2026-11-30T20:00:00+0000', 'source': 'webcam', 'seed': 7, **more}
    return Meeting(trials=trials, **kept)


def thirty_of_forty():
    trials = [
        trial(n, asked=1 + n % 5, proposed=1 + (n + (n % 4 == 0)) % 5, fixated=1 + n % 5)
        for n in range(1, 41)
    ]
    return meeting(*trials, learner='gaze_posterior', track='pixels', ended='all requests')


class Page(HTMLParser):
    """The elements and the text of a page; each element must be closed."""

    def __init__(self, html):
        super().__init__()
        self.tags, self.texts, self.attributes, self._open = [], [], [], []
        self.feed(html)
        assert not self._open, self._open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in _VOID and not self.get_starttag_text().endswith('/>'):
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs

    def handle_data(self, data):
        if not self._open or self._open[-1] != 'style':
            self.texts.append(data)

    @property
    def text(self):
        return ' '.join(' '.join(self.texts).split())


def test_it_states_the_figure_its_interval_and_chance(tmp_path):
    page = Page(write_report(thirty_of_forty(), tmp_path).read_text())
    assert '30 of 40 times the learner alone chose the thing' in page.text
    assert 'That is 75%; the 95 % interval reaches from 60% to 86%.' in page.text
    assert 'Guessing would reach 20%.' in page.text
    assert 'This is better than guessing.' in page.text
    assert 'The head itself ended at the right thing 40 of 40 times' in page.text
    assert {'gaze_posterior', 'pixels', 'a camera of this machine', '7'} <= set(page.texts)
    assert page.tags.count('svg') == 2


def test_it_needs_no_other_file_and_runs_no_script(tmp_path):
    page = Page(write_report(thirty_of_forty(), tmp_path).read_text())
    assert not {'script', 'link', 'iframe'} & set(page.tags)
    addresses = [value for name, value in page.attributes if name in ('src', 'href')]
    assert all(value.startswith('data:image/jpeg;base64,') for value in addresses)
    assert not any(name.startswith('on') for name, _ in page.attributes)


def test_it_is_written_beside_the_meeting_that_it_came_from(tmp_path):
    save_meeting(thirty_of_forty(), tmp_path)
    written = write_report(load_meeting(tmp_path / 'meeting.json'), tmp_path)
    assert written == tmp_path / 'report.html'
    assert report_html(thirty_of_forty(), tmp_path) == written.read_text()


def test_a_meeting_without_a_trial(tmp_path):
    page = Page(report_html(meeting(), tmp_path))
    assert 'There was no request with an answer.' in page.text
    assert 'svg' not in page.tags
    assert 'nan' not in page.text.lower()


def test_a_single_trial(tmp_path):
    page = Page(report_html(meeting(trial(1)), tmp_path))
    assert '1 of 1 times the learner alone' in page.text
    assert 'How it went' not in page.text
    assert 'nan' not in page.text.lower()


def test_a_meeting_without_a_proposal(tmp_path):
    trials = [trial(n, proposed=None, fixated=None) for n in range(1, 4)]
    page = Page(report_html(meeting(*trials), tmp_path))
    assert 'Nothing can be compared with guessing' in page.text
    assert 'times the learner alone' not in page.text
    assert 'no proposal' in page.text
    assert 'nan' not in page.text.lower()


def test_a_trial_without_things_is_shown(tmp_path):
    trials = [replace(trial(n), things={}) for n in (1, 2)]
    assert 'Guessing would reach 100%' in Page(report_html(meeting(*trials), tmp_path)).text


@pytest.mark.parametrize(
    ('successes', 'trials', 'chance', 'expected'),
    [
        (30, 40, 0.2, 'This is better than guessing.'),
        (0, 40, 0.2, 'This is worse than guessing.'),
        (3, 10, 0.2, 'This is not clearly better than guessing'),
        (0, 0, 0.2, 'Nothing can be compared'),
        (0, 0, math.nan, 'Nothing can be compared'),
    ],
)
def test_what_the_interval_lets_one_state(successes, trials, chance, expected):
    assert compared_with_chance(Rate(successes, trials), chance).startswith(expected)


def test_missed_requests_are_those_of_the_head_and_of_the_learner():
    right, head, learner = trial(1), trial(2, fixated=3), trial(3, proposed=2)
    nothing = trial(4, proposed=None)
    assert missed_trials(meeting(right, head, learner, nothing)) == [head, learner]


def test_missed_requests_are_shown_with_their_pictures(tmp_path):
    folder = tmp_path / 'pictures'
    folder.mkdir()
    picture = np.random.default_rng(0).integers(0, 255, (480, 640, 3), np.uint8)
    cv2.imwrite(str(folder / 'face.jpg'), picture)
    missed = trial(
        1, asked=4, fixated=2, proposed=None,
        face_picture='pictures/face.jpg', view_picture='pictures/gone.jpg',
    )  # fmt: skip
    html = report_html(meeting(missed), tmp_path)
    page = Page(html)
    assert 'Request 1: thing 4' in page.text
    assert '✕ thing 2, wrong' in page.text
    [address] = [value for name, value in page.attributes if name == 'src']
    content = base64.b64decode(address.partition(',')[2])
    shown = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert shown.shape == (180, 240, 3)
    assert page.texts.count('no picture') == 1


@pytest.mark.parametrize(
    'name',
    ['', '..', '../secret.jpg', '/etc/passwd', 'damaged.jpg', 'empty.jpg', 'a\0b', 'x' * 999],
)
def test_a_picture_that_is_none_is_left_out(tmp_path, name):
    folder = tmp_path / 'meeting'
    folder.mkdir()
    cv2.imwrite(str(tmp_path / 'secret.jpg'), np.zeros((9, 9, 3), np.uint8))
    (folder / 'damaged.jpg').write_bytes(b'\xff\xd8\xff no picture')
    (folder / 'empty.jpg').touch()
    missed = trial(1, fixated=None, face_picture=name)
    page = Page(report_html(meeting(missed), folder))
    assert 'img' not in page.tags
    assert page.texts.count('no picture') == 2


def test_odd_characters_are_escaped(tmp_path):
    odd = '<script>alert(1)</script> & "é" \u202e \0 \ud800 名'
    shown = write_report(
        meeting(trial(1), learner=odd, track=odd, source=odd, started=odd, ended=odd), tmp_path
    )
    page = Page(shown.read_text())
    assert 'script' not in page.tags
    assert page.text.count('<script>alert(1)</script> & "é"') == 7
    assert '\0' not in page.text
    assert '名' in page.text


def test_of_many_missed_requests_the_last_are_shown(tmp_path):
    trials = [trial(n, fixated=2) for n in range(1, MOST_MISSED + 6)]
    page = Page(report_html(meeting(*trials), tmp_path))
    assert f'The last {MOST_MISSED} are shown.' in page.text
    assert sum('thing 1' in text and 'Request' in text for text in page.texts) == MOST_MISSED


def test_things_are_counted_one_by_one(tmp_path):
    trials = [trial(1, 1), trial(2, 2, proposed=2, fixated=2), trial(3, 2, proposed=5, fixated=2)]
    html = report_html(meeting(*trials), tmp_path)
    assert '<tr><td>1</td><td>1</td><td>1 of 1</td><td>0 of 1</td></tr>' not in html
    assert '<tr><td>1</td><td>1</td><td>1 of 1</td><td>1 of 1</td></tr>' in html
    assert '<tr><td>2</td><td>2</td><td>1 of 2</td><td>2 of 2</td></tr>' in html


def test_the_curve_stays_in_its_drawing(tmp_path):
    html = report_html(thirty_of_forty(), tmp_path)
    curve = re.findall(r'<svg.*?</svg>', html)[1]
    ElementTree.fromstring(curve)
    points = [
        tuple(map(float, point.split(',')))
        for line in re.findall(r'points="([^"]*)"', curve)
        for point in line.split()
    ]
    assert len(points) == 40 * 5
    assert all(44 <= x <= 644.01 and 9.99 <= y <= 230.01 for x, y in points)
