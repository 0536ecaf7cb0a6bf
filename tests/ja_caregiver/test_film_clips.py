"""Clips of a film: the right pictures at the right times, from films of any rate."""

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from ja_caregiver.core.film_clips import (
    ClipReader,
    directions_of_places,
    film_facts,
    places_of_directions,
)
from ja_caregiver.core.schedule import ScheduledLook
from ja_common.core.config import ConfigError
from ja_perception.core.frame_sources import SourceError
from ja_sim.core.digital_head import DigitalHead, DigitalHeadConfig

LOOK = ScheduledLook(1.0, 2.0, 3.0, 1)


class NumberedPictures:
    """A film whose n-th picture is of grey level n."""

    def __init__(self, count: int, rate_hz: float, broken: tuple[int, ...] = ()) -> None:
        self.summary = 'a film'
        self.period_s = 1 / rate_hz
        self._numbers: Iterator[int] = iter(range(count))
        self._broken = broken
        self.closed = False

    def next_frame(self) -> NDArray[np.uint8] | None:
        number = next(self._numbers, None)
        if number is None:
            return None
        if number in self._broken:
            raise SourceError(f'picture {number} cannot be decoded')
        return np.full((6, 8, 3), number, np.uint8)

    def close(self) -> None:
        self.closed = True


def reader(film: NumberedPictures, warn: Callable = lambda *_: None, **changes: float):
    options = {'rate_hz': 10.0, 'shown_s': 10.0, **changes}
    return ClipReader(film, warn, **options)


def shown(clip) -> list[int]:
    return [int(picture[0, 0, 0]) for picture in clip.pictures]


@pytest.mark.parametrize('rate_hz', [5.0, 10.0, 24.0, 30.0])
def test_a_clip_has_the_pictures_of_its_times_at_any_rate(rate_hz):
    clip = reader(NumberedPictures(200, rate_hz)).read_clip(LOOK)
    times = 1.0 + 0.1 * np.arange(20)
    assert shown(clip) == np.floor(times * rate_hz + 1e-6).astype(int).tolist()
    assert clip.camera_pictures == 10


def test_only_the_end_of_a_long_look_is_shown():
    clip = reader(NumberedPictures(200, 10.0), shown_s=0.5).read_clip(LOOK)
    assert shown(clip) == [25, 26, 27, 28, 29]
    assert clip.camera_pictures == 1


def test_an_offset_moves_all_times():
    clip = reader(NumberedPictures(200, 10.0), offset_s=2.0).read_clip(LOOK)
    assert shown(clip)[0] == 30


def test_clips_follow_each_other_in_one_pass():
    clips = reader(NumberedPictures(200, 10.0))
    clips.read_clip(LOOK)
    again = clips.read_clip(ScheduledLook(3.0, 4.0, 5.0, 2))
    assert shown(again) == list(range(30, 50))


def test_a_film_that_ends_before_the_look_gives_no_clip():
    clips = reader(NumberedPictures(25, 10.0))
    assert clips.read_clip(LOOK) is None
    assert clips.read_s == pytest.approx(2.5)
    assert clips.read_clip(ScheduledLook(3.0, 4.0, 5.0, 2)) is None


def test_a_look_before_the_film_begins_gives_no_clip():
    assert reader(NumberedPictures(99, 10.0), offset_s=-3.0).read_clip(LOOK) is None


def test_a_picture_that_cannot_be_decoded_is_reported_and_left_out():
    texts: list[str] = []
    film = NumberedPictures(99, 10.0, broken=(15,))
    clip = reader(film, lambda _, text: texts.append(text)).read_clip(LOOK)
    assert shown(clip)[4:7] == [14, 14, 16]
    assert texts == ['picture 15 cannot be decoded']


def test_a_wide_film_is_made_smaller():
    clip = reader(NumberedPictures(99, 10.0), largest_width=lambda _: 4).read_clip(LOOK)
    assert clip.pictures[0].shape == (3, 4, 3)


def test_places_and_directions_are_inverse_and_agree_with_the_head():
    places = ((0.5, 0.5), (0.1, 0.3), (0.9, 0.8), (0.02, 0.97))
    size, view = (1280, 720), 1.2
    directions = directions_of_places(places, size, view)
    assert places_of_directions(directions, size, view) == pytest.approx(np.array(places))
    head = DigitalHead(DigitalHeadConfig(wide_view_rad=view, time_constant_s=0.001))
    for (u, v), direction in zip(places[:3], directions, strict=False):
        wide = np.zeros((720, 1280, 3), np.uint8)
        cv2.circle(wide, (round(u * 1280 - 0.5), round(v * 720 - 0.5)), 8, (255, 255, 255), -1)
        head.command(direction)
        head.render_view(wide, 0)
        view_picture, _ = head.render_view(wide, 10**9)
        rows, columns = np.nonzero(view_picture[..., 0] > 100)
        assert (columns.mean(), rows.mean()) == pytest.approx((159.5, 119.5), abs=1.5)


def test_a_direction_outside_of_the_picture_has_no_place():
    with pytest.raises(ValueError, match='outside'):
        places_of_directions(np.array([[1.4, 0.0]]), (1280, 720), 1.2)


def write_film(path: Path, count: int) -> None:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*'MJPG'), 10.0, (64, 48))
    for _ in range(count):
        writer.write(np.zeros((48, 64, 3), np.uint8))
    writer.release()


def test_facts_of_a_film(tmp_path: Path):
    write_film(tmp_path / 'film.avi', 25)
    facts = film_facts(tmp_path / 'film.avi')
    assert (facts.width, facts.height, facts.length_s) == (64, 48, pytest.approx(2.5))


def test_what_is_no_film_is_refused(tmp_path: Path):
    (tmp_path / 'text.mp4').write_text('no film')
    (tmp_path / 'empty.mp4').touch()
    write_film(tmp_path / 'cut.avi', 25)
    cut = (tmp_path / 'cut.avi').read_bytes()[:500]
    (tmp_path / 'cut.avi').write_bytes(cut)
    for name in ('text.mp4', 'empty.mp4', 'cut.avi', 'missing.mp4', '.'):
        with pytest.raises(ConfigError) as caught:
            film_facts(tmp_path / name)
        assert name in str(caught.value) or str(tmp_path) in str(caught.value)
