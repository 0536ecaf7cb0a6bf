"""The spoken schedule: beeps at the right times, and a page in one file."""

import io
import json
import re
import wave
from pathlib import Path

import numpy as np
import pytest

from ja_caregiver.core.schedule import make_schedule
from ja_caregiver.core.spoken_schedule import (
    SAMPLE_RATE_HZ,
    make_cues,
    page_of,
    save_page,
    save_sound,
    sound_of,
)

PLAN = make_schedule(1, 12, 5)


def bursts(samples: np.ndarray) -> list[tuple[float, float]]:
    """Return begin and length [s] of every tone."""
    block = SAMPLE_RATE_HZ // 100
    loud = np.abs(samples[: len(samples) // block * block].reshape(-1, block)).max(1) > 1000
    edges = np.flatnonzero(np.diff(np.concatenate([[False], loud, [False]]).astype(int)))
    return [(begin / 100, (end - begin) / 100) for begin, end in edges.reshape(-1, 2)]


def test_three_beeps_mark_time_zero_and_each_thing_has_its_count():
    found = bursts(sound_of(PLAN))
    assert [begin for begin, _ in found[:3]] == pytest.approx([0, 1, 2], abs=0.02)
    for look in PLAN.looks:
        counted = [begin for begin, _ in found if look.start_s - 0.02 <= begin < look.end_s - 0.1]
        assert len(counted) == look.thing
        assert counted[0] == pytest.approx(look.start_s, abs=0.02)
        (low,) = [each for each in found if abs(each[0] - look.camera_s) < 0.02]
        assert low[1] == pytest.approx(0.4, abs=0.03)


def test_the_sound_is_a_wav_file(tmp_path: Path):
    save_sound(PLAN, tmp_path / 'plan.wav')
    with wave.open(io.BytesIO((tmp_path / 'plan.wav').read_bytes())) as file:
        assert (file.getnchannels(), file.getsampwidth()) == (1, 2)
        assert file.getframerate() == SAMPLE_RATE_HZ
        assert file.getnframes() / SAMPLE_RATE_HZ == pytest.approx(PLAN.end_s + 1, abs=0.01)


def test_cues_come_in_the_order_of_time_with_words_and_numbers():
    cues = make_cues(PLAN)
    assert [cue.time_s for cue in cues] == sorted(cue.time_s for cue in cues)
    looks = [cue for cue in cues if cue.kind == 'look']
    assert [cue.large for cue in looks] == [str(look.thing) for look in PLAN.looks]
    assert [cue.spoken for cue in looks] == [cue.large for cue in looks]
    assert sum(cue.kind == 'rearrange' for cue in cues) == 2
    assert cues[-1].done == 1.0


def test_the_page_is_one_file_with_all_cues(tmp_path: Path):
    save_page(PLAN, tmp_path / 'plan.html')
    page = (tmp_path / 'plan.html').read_text()
    assert page == page_of(PLAN)
    assert not re.search(r'(src|href)\s*=|https?://|@import', page), 'nothing is loaded'
    data = re.search(r'<script type="application/json" id="cues">(.*?)</script>', page, re.DOTALL)
    assert data is not None
    assert len(json.loads(data[1])) == len(make_cues(PLAN))
    assert 'speechSynthesis' in page
    assert 'AudioContext' in page
    assert '12 looks' in page
