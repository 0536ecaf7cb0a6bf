"""A schedule that a person follows while filming: as a web page that speaks, and as beeps (WAV).

Three short high beeps mark time zero, the first of them exactly. Then a long low beep asks for a
look at the camera, as many short high beeps as the number of the thing for a look at that thing,
and two falling tones ask to move the things. The page speaks and shows the same.
"""

from __future__ import annotations

import html
import io
import json
import wave
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ja_caregiver.core.schedule import Rearrangement, Schedule
from ja_common.core.files import write_file

SAMPLE_RATE_HZ = 16000
_AMPLITUDE, _FADE_S = 0.6, 0.008
_ZERO_HZ, _CAMERA_HZ, _COUNT_HZ = 1320.0, 440.0, 880.0
_ZERO_S, _CAMERA_BEEP_S, _COUNT_S, _COUNT_EVERY_S = 0.12, 0.4, 0.08, 0.16
_TAIL_S = 1.0

Beep = tuple[float, float, float]
"""Seconds after the cue, frequency [Hz], length [s]."""


@dataclass(frozen=True)
class Cue:
    """What is shown, spoken and played at a time of the schedule.

    `large`: the number or word that is shown large. `done`: share of the looks that are over, 0-1.
    """

    time_s: float
    kind: str
    large: str
    sentence: str
    spoken: str
    beeps: tuple[Beep, ...]
    done: float = 0.0


def make_cues(schedule: Schedule) -> list[Cue]:
    """Return the cues of a schedule in the order of time."""
    cues = [
        Cue(0.0, 'zero', '3', 'Clap your hands at this beep.', '', (_zero_beep(),)),
        Cue(1.0, 'zero', '2', 'It starts now.', '', (_zero_beep(),)),
        Cue(2.0, 'zero', '1', 'It starts now.', '', (_zero_beep(),)),
    ]
    looks, shown = len(schedule.looks), 0
    for segment in schedule.segments:
        done = shown / looks
        if isinstance(segment, Rearrangement):
            tones = ((0.0, 700.0, 0.3), (0.35, 350.0, 0.5))
            text = 'Move the things to other places.'
            cues.append(Cue(segment.start_s, 'rearrange', 'Move', text, text, tones, done))
            continue
        camera = ((0.0, _CAMERA_HZ, _CAMERA_BEEP_S),)
        text = 'Look at the camera.'
        cues.append(Cue(segment.camera_s, 'camera', 'Camera', text, 'camera', camera, done))
        number = segment.thing
        count = tuple((_COUNT_EVERY_S * each, _COUNT_HZ, _COUNT_S) for each in range(number))
        text = f'Look at thing {number}.'
        cues.append(Cue(segment.start_s, 'look', str(number), text, str(number), count, done))
        shown += 1
    end = 'That was all. Stop the film.'
    cues.append(Cue(schedule.end_s, 'end', 'End', end, end, (), 1.0))
    return cues


def sound_of(schedule: Schedule) -> NDArray[np.int16]:
    """Return the beeps of a schedule as samples (n,) at SAMPLE_RATE_HZ."""
    samples = np.zeros(round((schedule.end_s + _TAIL_S) * SAMPLE_RATE_HZ), np.float32)
    for cue in make_cues(schedule):
        for after_s, hertz, length_s in cue.beeps:
            begin = round((cue.time_s + after_s) * SAMPLE_RATE_HZ)
            tone = _tone(hertz, length_s)[: len(samples) - begin]
            samples[begin : begin + len(tone)] += tone
    return (np.clip(samples, -1, 1) * np.iinfo(np.int16).max).astype(np.int16)


def save_sound(schedule: Schedule, path: Path) -> None:
    """Write the beeps as a WAV file. Raises SaveError."""
    content = io.BytesIO()
    with wave.open(content, 'wb') as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(SAMPLE_RATE_HZ)
        file.writeframes(sound_of(schedule).astype('<i2').tobytes())
    write_file(path, content.getvalue())


def page_of(schedule: Schedule) -> str:
    """Return a web page in one file that shows, speaks and plays a schedule."""
    cues = json.dumps([asdict(cue) for cue in make_cues(schedule)])
    things = schedule.things
    steps = [
        f'Put {things} things before you, and number them from left to right: 1 to {things}.',
        'Put the camera in front of you, at the height of your eyes, so that it films you and '
        'all things. It must not move.',
        'Start to film. Then press Start here, with the sound on.',
        'Clap your hands at the first beep: from it you find where the schedule begins in the '
        'film.',
        'Look where the voice asks you to look, until it speaks again. Turn your head and your '
        'eyes, as you do when a person shows you something.',
    ]
    listed = '\n'.join(f'<li>{html.escape(step)}</li>' for step in steps)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>A spoken schedule</title>
<style>
{_resource('page.css')}</style>
</head>
<body>
<header>
<h1>Film yourself</h1>
<p>{len(schedule.looks)} looks in {schedule.end_s / 60:.1f} min. You need a phone or a camera
that films, and this page.</p>
<ol>
{listed}
</ol>
</header>
<main aria-live="polite">
<div id="number"></div>
<p id="sentence"></p>
<button id="start" type="button">Start</button>
</main>
<footer><progress id="progress" max="1" value="0">progress</progress></footer>
<script type="application/json" id="cues">{cues}</script>
<script>
{_resource('page.js')}</script>
</body>
</html>
"""


def save_page(schedule: Schedule, path: Path) -> None:
    """Write the page of a schedule. Raises SaveError."""
    write_file(path, page_of(schedule))


def _zero_beep() -> Beep:
    return (0.0, _ZERO_HZ, _ZERO_S)


def _tone(hertz: float, length_s: float) -> NDArray[np.float32]:
    """Return one beep (n,), which fades in and out so that it does not click."""
    times = np.arange(round(length_s * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ
    edge = np.minimum(1.0, np.minimum(times, length_s - times) / _FADE_S)
    return (_AMPLITUDE * edge * np.sin(2 * np.pi * hertz * times)).astype(np.float32)


def _resource(name: str) -> str:
    return (resources.files('ja_caregiver') / 'spoken' / name).read_text(encoding='utf-8')
