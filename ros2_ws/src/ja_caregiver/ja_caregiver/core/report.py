"""The report of a meeting: one page of HTML that holds its pictures and needs no other file."""

import base64
import math
from collections.abc import Iterable, Sequence
from html import escape
from importlib import metadata
from pathlib import Path

import cv2
import numpy as np

from ja_caregiver.core.meeting import Meeting, MeetingTrial
from ja_common.core.files import write_file
from ja_common.core.safe_files import read_bytes
from ja_common.core.statistics import Rate

REPORT_FILE = 'report.html'
WINDOW = 10
"""Choices of the learner over which each point of the curve is taken."""
MOST_MISSED = 60
"""Missed requests that are shown with their pictures, the last ones."""
_PICTURE_PX = (240, 180)
_LARGEST_PICTURE = 20_000_000
_QUALITY = 80
_SOURCES = {
    'webcam': 'a camera of this machine',
    'topics': 'the topics of a rig',
    'film': 'a film',
}

_STYLE = Path(__file__).with_name('report.css')


def write_report(meeting: Meeting, folder: Path) -> Path:
    """Write the report of a meeting into its folder, and return its file. Raises SaveError.

    A picture that is missing or damaged is left out, and the page states it.
    """
    path = folder / REPORT_FILE
    write_file(path, report_html(meeting, folder))
    return path


def report_html(meeting: Meeting, folder: Path) -> str:
    """Return the report; `folder` holds the pictures that the trials name."""
    parts = [
        '<h1>A meeting with a robot that learns to follow your gaze</h1>',
        f'<p class="quiet">{_text(meeting.started)}, from {_text(_source(meeting))}. '
        f'It ended: {_text(meeting.ended or "not yet")}.</p>',
        _summary(meeting),
        _what_was_measured(),
        _curve(meeting),
        _missed(meeting, folder),
        _table_of_things(meeting),
        _table_of_requests(meeting),
        _settings(meeting),
    ]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<title>Joint attention: the report of a meeting</title>'
        f'<style>{_STYLE.read_text()}</style></head>\n'
        f'<body>\n{chr(10).join(part for part in parts if part)}\n</body></html>\n'
    )


def compared_with_chance(rate: Rate, chance: float) -> str:
    """Return what the interval of a rate lets one state about chance, in one sentence."""
    low, high = rate.interval
    if not rate.trials or math.isnan(chance):
        return 'Nothing can be compared with guessing: the learner made no choice.'
    if low > chance:
        return 'This is better than guessing.'
    if high < chance:
        return 'This is worse than guessing.'
    return 'This is not clearly better than guessing: there were too few requests, or it was not.'


def missed_trials(meeting: Meeting) -> list[MeetingTrial]:
    """Return the trials in which the head, or the learner's own choice, missed what was asked."""
    return [each for each in meeting.trials if not each.success or each.learner_right is False]


def _summary(meeting: Meeting) -> str:
    rate, chance = meeting.learner_rate(), meeting.chance()
    if not meeting.trials:
        return '<p class="judgement">There was no request with an answer.</p>'
    head = meeting.success_rate()
    parts = []
    if rate.trials:
        low, high = rate.interval
        parts.append(
            f'<p class="total"><b>{rate.successes} of {rate.trials}</b> '
            '<span>times the learner alone chose the thing that you looked at</span></p>'
            f'<p>That is {_percent(rate.rate)}; the 95 % interval reaches from {_percent(low)} to '
            f'{_percent(high)}. Guessing would reach {_percent(chance)}.</p>'
            f'{_scale(rate, chance)}'
        )
    parts.append(f'<p class="judgement">{compared_with_chance(rate, chance)}</p>')
    half = meeting.learner_rate(slice(len(meeting.trials) // 2, None))
    if rate.trials > 1 and half.trials:
        parts.append(
            f'<p>It learned while you met. In the second half: {half.successes} of {half.trials}, '
            f'{_percent(half.rate)}, interval {_interval(half)}.</p>'
        )
    parts.append(
        f'<p>The head itself ended at the right thing {head.successes} of {head.trials} times, '
        f'{_percent(head.rate)}, interval {_interval(head)}. It also follows what is salient, and '
        'may look at several things before it stops.</p>'
    )
    return '\n'.join(parts)


def _what_was_measured() -> str:
    return (
        '<h2>What was measured</h2>'
        '<p>You were asked to look at one of the numbered things. The robot saw your face, not '
        'the request: neither the part that learns nor the part that moves the head receives the '
        'number. From your face the learner proposed where you look. <b>The learner alone is '
        'right</b> if, of all things, the one that you were asked to look at is nearest to that '
        'place. Requests in which it proposed nothing do not count for it.</p>'
        '<p>Guessing is the success of choosing any of the things that the head knew. The '
        'interval (Wilson, 95 %) holds the rate that many more requests like these would show.</p>'
    )


def _scale(rate: Rate, chance: float) -> str:
    """Draw the interval of a rate against chance."""
    low, high = rate.interval
    x0, width = 8.0, 684.0
    at = [x0 + width * each for each in (low, high, rate.rate, chance)]
    return (
        '<svg viewBox="0 0 700 62" role="img" aria-label="the interval against guessing">'
        f'<rect x="{x0}" y="24" width="{width}" height="14" rx="7" fill="#e3e9ef"/>'
        f'<rect x="{at[0]:.1f}" y="24" width="{max(at[1] - at[0], 2):.1f}" height="14" rx="7" '
        'fill="#56b4e9"/>'
        f'<line x1="{at[2]:.1f}" x2="{at[2]:.1f}" y1="20" y2="42" stroke="#15202b" '
        'stroke-width="3"/>'
        f'<line x1="{at[3]:.1f}" x2="{at[3]:.1f}" y1="16" y2="46" stroke="#b35900" '
        'stroke-width="3" stroke-dasharray="4 3"/>'
        f'<text x="{at[3]:.1f}" y="12" text-anchor="{_anchor(chance)}">guessing</text>'
        f'<text x="{x0}" y="58">0 %</text>'
        f'<text x="{x0 + width}" y="58" text-anchor="end">100 %</text></svg>'
    )


def _curve(meeting: Meeting) -> str:
    """Draw the success over the requests: the learner alone, the head, and chance."""
    if len(meeting.trials) < 2:
        return ''
    left, top, width, height = 44.0, 10.0, 600.0, 220.0
    last = len(meeting.trials)

    def x(trial: int) -> float:
        return left + width * (trial - 1) / (last - 1)

    def y(share: float) -> float:
        return top + height * (1 - share)

    choices = [index for index, each in enumerate(meeting.trials, 1) if each.proposed is not None]
    learner: list[tuple[int, Rate]] = []
    for count, index in enumerate(choices):
        first = choices[max(0, count + 1 - WINDOW)]
        learner.append((index, meeting.learner_rate(slice(first - 1, index))))
    head = [
        (index, meeting.success_rate(slice(max(0, index - WINDOW), index)).rate)
        for index in range(1, last + 1)
    ]
    chance = [(index, meeting.trials[index - 1].chance) for index in range(1, last + 1)]

    def line(points: Iterable[tuple[int, float]]) -> str:
        return ' '.join(f'{x(trial):.1f},{y(share):.1f}' for trial, share in points)

    upper = [(trial, rate.interval[1]) for trial, rate in learner]
    lower = [(trial, rate.interval[0]) for trial, rate in reversed(learner)]
    grid = ''.join(
        f'<line x1="{left}" x2="{left + width}" y1="{y(share):.1f}" y2="{y(share):.1f}" '
        f'stroke="#d7dee6"/><text x="{left - 6}" y="{y(share) + 4:.1f}" text-anchor="end">'
        f'{share:.0%}</text>'
        for share in (0.0, 0.25, 0.5, 0.75, 1.0)
    )
    drawn = [
        f'<polygon points="{line([*upper, *lower])}" fill="#56b4e9" fill-opacity=".28"/>',
        f'<polyline points="{line(head)}" fill="none" stroke="#526070" stroke-width="1.6" '
        'stroke-dasharray="2 3"/>',
        f'<polyline points="{line(chance)}" fill="none" stroke="#b35900" stroke-width="2" '
        'stroke-dasharray="8 5"/>',
        f'<polyline points="{line((trial, rate.rate) for trial, rate in learner)}" fill="none" '
        'stroke="#0b6cab" stroke-width="3"/>',
    ]
    bottom = top + height
    return (
        '<h2>How it went</h2><figure>'
        f'<svg viewBox="0 0 660 262" role="img" aria-label="success over the requests">{grid}'
        f'{"".join(drawn)}<text x="{left}" y="{bottom + 18}">request 1</text>'
        f'<text x="{left + width}" y="{bottom + 18}" text-anchor="end">request {last}</text></svg>'
        f'<figcaption>Solid, blue: the learner alone, last {WINDOW} choices, with its 95 % '
        f'interval. Dots, grey: the head, last {WINDOW} requests. Dashes, orange: guessing.'
        '</figcaption></figure>'
    )


def _missed(meeting: Meeting, folder: Path) -> str:
    missed = missed_trials(meeting)
    if not missed:
        return '<h2>Missed requests</h2><p>None was missed.</p>' if meeting.trials else ''
    shown = missed[-MOST_MISSED:]
    note = '' if shown == missed else f' The last {len(shown)} are shown.'
    cards = '\n'.join(_missed_card(each, folder) for each in shown)
    return (
        f'<h2>Missed requests</h2><p>{len(missed)} of {len(meeting.trials)}: the head, or the '
        f'learner by itself, chose another thing.{note}</p><div class="missed">{cards}</div>'
    )


def _missed_card(trial: MeetingTrial, folder: Path) -> str:
    pictures = (
        _figure(folder, trial.face_picture, 'your face when you were asked'),
        _figure(folder, trial.view_picture, 'what the head looked at'),
    )
    return (
        f'<section><h3>Request {trial.trial}: thing {trial.asked}</h3>'
        f'<div>The learner alone: {_choice(trial.proposed, trial.asked, "no proposal")}</div>'
        f'<div>The head: {_choice(trial.fixated, trial.asked, "no thing")}</div>'
        f'<div class="pictures">{"".join(pictures)}</div></section>'
    )


def _figure(folder: Path, name: str, caption: str) -> str:
    picture = _embedded(folder, name)
    shown = (
        f'<img src="{picture}" alt="{caption}">'
        if picture
        else '<div class="none">no picture</div>'
    )
    return f'<figure>{shown}<figcaption>{caption}</figcaption></figure>'


def _embedded(folder: Path, name: str) -> str:
    """Return a picture of the meeting's folder as a small data address; '' if there is none."""
    try:
        path = (folder / name).resolve()
        if not name or not path.is_relative_to(folder.resolve()):
            return ''
        content = np.frombuffer(read_bytes(path, _LARGEST_PICTURE), np.uint8)
        picture = cv2.imdecode(content, cv2.IMREAD_COLOR) if content.size else None
    except (OSError, ValueError, cv2.error):
        return ''
    if picture is None:
        return ''
    height, width = picture.shape[:2]
    scale = min(1.0, _PICTURE_PX[0] / width, _PICTURE_PX[1] / height)
    size = max(1, round(scale * width)), max(1, round(scale * height))
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    jpeg = cv2.imencode('.jpg', small, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1]
    return f'data:image/jpeg;base64,{base64.b64encode(jpeg.tobytes()).decode()}'


def _table_of_things(meeting: Meeting) -> str:
    numbers = sorted({each.asked for each in meeting.trials})
    if not numbers:
        return ''
    rows = []
    for number in numbers:
        asked = Meeting('', '', 0, trials=tuple(e for e in meeting.trials if e.asked == number))
        learner, head = asked.learner_rate(), asked.success_rate()
        alone = f'{learner.successes} of {learner.trials}' if learner.trials else 'no proposal'
        rows.append((number, head.trials, alone, f'{head.successes} of {head.trials}'))
    return (
        '<h2>Thing by thing</h2>'
        f'{_table(("thing", "asked", "learner alone right", "head right"), rows)}'
        '<p class="quiet">A thing keeps its number until the things are moved.</p>'
    )


def _table_of_requests(meeting: Meeting) -> str:
    if not meeting.trials:
        return ''
    rows = [
        (
            each.trial,
            each.asked,
            len(each.things),
            _choice(each.proposed, each.asked, 'no proposal'),
            _choice(each.fixated, each.asked, 'no thing'),
            'the learner' if each.followed_learner else 'what is salient',
        )
        for each in meeting.trials
    ]
    heads = ('request', 'thing', 'of', 'learner alone', 'head', 'the head followed')
    return f'<h2>All requests</h2>{_table(heads, rows)}'


def _table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; the cells are HTML."""
    head = ''.join(f'<th>{each}</th>' for each in heads)
    body = ''.join(f'<tr>{"".join(f"<td>{cell}</td>" for cell in row)}</tr>' for row in rows)
    return f'<div class="table"><table><tr>{head}</tr>{body}</table></div>'


def _settings(meeting: Meeting) -> str:
    shown = {
        'learner': meeting.learner or 'not stated',
        'track': meeting.track or 'not stated',
        'pictures from': _source(meeting),
        'seed of the requests': str(meeting.seed),
        'started': meeting.started,
        'version': metadata.version('ja_caregiver'),
    }
    rows = ''.join(f'<dt>{name}</dt><dd>{_text(value)}</dd>' for name, value in shown.items())
    return f'<h2>Settings</h2><dl>{rows}</dl>'


def _choice(number: int | None, asked: int, none: str) -> str:
    """Return a chosen thing with a symbol and a word, so that no colour is needed to read it."""
    if number is None:
        return f'<span class="wrong">✕ {none}</span>'
    right = number == asked
    kind = 'right' if right else 'wrong'
    return f'<span class="{kind}">{"✓" if right else "✕"} thing {number}, {kind}</span>'


def _source(meeting: Meeting) -> str:
    return _SOURCES.get(meeting.source, meeting.source)


def _text(text: str) -> str:
    """Return a text for HTML; what no page can show is replaced."""
    shown = ''.join(each if each.isprintable() else '\ufffd' for each in text)
    return escape(shown)


def _percent(share: float) -> str:
    return '-' if math.isnan(share) else f'{share:.0%}'


def _interval(rate: Rate) -> str:
    return ' to '.join(_percent(end) for end in rate.interval)


def _anchor(share: float) -> str:
    """Return how a label at a place of the scale is aligned, so that it stays in the drawing."""
    return 'start' if share < 0.08 else 'end' if share > 0.92 else 'middle'
