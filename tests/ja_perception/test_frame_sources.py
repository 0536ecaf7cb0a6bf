"""Pictures from files, folders and devices as they are in the wild; clear sentences otherwise."""

import cv2
import numpy as np
import pytest

from ja_perception.core.film import FrameTimes
from ja_perception.core.frame_sources import SourceError, SourceOptions
from ja_perception.core.open_source import open_source
from ja_perception.core.picture_folder import natural_order
from picture_files import (
    cut,
    flat,
    jpeg_with_orientation,
    palette_png,
    tiff,
    write_film,
    write_picture,
)

RED, GREEN, BLUE = (200, 0, 0), (0, 200, 0), (0, 0, 200)
ONCE = SourceOptions(loop=False, rate_hz=1.0, still_s=1.0)
FOR_EVER = SourceOptions(loop=True, rate_hz=1.0, still_s=1.0)


class Warnings(list):
    """The warnings of a source."""

    def __call__(self, where, text):
        self.append((where, text))

    def texts(self, where):
        return [text for place, text in self if place == where]


@pytest.fixture
def warn():
    return Warnings()


def colours(source, count):
    """Return the colour of each of the next pictures."""
    names = []
    for _ in range(count):
        frame = source.next_frame()
        middle = None if frame is None else frame[frame.shape[0] // 2, frame.shape[1] // 2]
        names.append('end' if frame is None else ('red', 'green', 'blue')[middle.argmax()])
    return names


def test_single_image_never_ends(tmp_path, warn):
    source = open_source(write_picture(tmp_path / 'a.png', flat(RED)), SourceOptions(False), warn)
    assert colours(source, 3) == ['red'] * 3
    assert source.period_s == pytest.approx(1 / 15)
    assert not warn


def test_folder_shows_each_picture_for_a_while(tmp_path, warn):
    write_picture(tmp_path / 'b.png', flat(GREEN))
    write_picture(tmp_path / 'a.jpg', flat(RED))
    options = SourceOptions(loop=False, rate_hz=4.0, still_s=0.5)
    source = open_source(str(tmp_path), options, warn)
    assert colours(source, 5) == ['red', 'red', 'green', 'green', 'end']
    assert source.period_s == 0.25
    looped = open_source(str(tmp_path), FOR_EVER, warn)
    assert colours(looped, 3) == ['red', 'green', 'red']


def test_pictures_come_in_natural_order(tmp_path, warn):
    for name, colour in (('1.png', RED), ('10.png', BLUE), ('2.png', GREEN)):
        write_picture(tmp_path / name, flat(colour))
    assert colours(open_source(str(tmp_path), ONCE, warn), 4) == ['red', 'green', 'blue', 'end']
    mixed = ['img12b', 'IMG2', 'a', 'img12', '7', '007', '', 'img1']
    assert sorted(mixed, key=natural_order) == [
        '', '7', '007', 'a', 'img1', 'IMG2', 'img12', 'img12b',
    ]  # fmt: skip


def test_what_is_no_picture_is_skipped_and_counted(tmp_path, warn):
    write_picture(tmp_path / 'a.png', flat(RED))
    (tmp_path / 'b').write_bytes((tmp_path / 'a.png').read_bytes())  # a picture by its content
    for name in ('._a.png', '.DS_Store', 'Thumbs.db', 'notes.txt', 'c.png'):
        (tmp_path / name).write_bytes(b'\0\5\x16\7 no picture')
    write_film(tmp_path / 'd.avi', [flat(RED)] * 2, 10.0)
    write_picture(tmp_path / 'more' / 'e.png', flat(GREEN))
    source = open_source(str(tmp_path), ONCE, warn)
    assert colours(source, 3) == ['red', 'red', 'end']
    for part in (
        "2 of 9 files in '", "3 hidden or of the system ('._a.png', '.DS_Store', 'Thumbs.db')",
        "1 folder ('more')", "1 damaged ('c.png')", "1 film: give it as the source itself ('d.avi",
        "1 of a format that OpenCV does not read as a picture ('notes.txt')",
    ):  # fmt: skip
        assert part in source.summary


@pytest.mark.parametrize('extension', ['.jpg', '.png', '.bmp', '.tif', '.webp', '.ppm'])
def test_a_damaged_picture_is_skipped_with_a_warning_and_no_end(tmp_path, warn, extension):
    noise = np.random.default_rng(0).integers(0, 255, (200, 300, 3), np.uint8)
    write_picture(tmp_path / f'a{extension}', noise)
    cut(tmp_path / f'a{extension}')
    write_picture(tmp_path / 'b.png', flat(GREEN))
    source = open_source(str(tmp_path), FOR_EVER, warn)
    assert colours(source, 3) == ['green'] * 3
    assert f'a{extension}' in warn.texts('damaged pictures')[0]
    assert '1 of 2 files' in source.summary
    assert f"1 damaged ('a{extension}')" in source.summary


def test_a_picture_that_is_completed_later_is_shown(tmp_path, warn):
    write_picture(tmp_path / 'b.png', flat(GREEN))
    write_picture(tmp_path / 'a.png', flat(RED))
    whole = (tmp_path / 'a.png').read_bytes()
    cut(tmp_path / 'a.png')
    source = open_source(str(tmp_path), FOR_EVER, warn)
    assert colours(source, 1) == ['green']
    (tmp_path / 'a.png').write_bytes(whole)
    assert colours(source, 2) == ['red', 'green']
    assert source.summary.startswith('2 of 2 files')


def test_only_when_no_picture_is_left_is_that_an_error(tmp_path, warn):
    write_picture(tmp_path / 'a.png', flat(RED))
    whole = (tmp_path / 'a.png').read_bytes()
    source = open_source(str(tmp_path), FOR_EVER, warn)
    assert colours(source, 1) == ['red']
    cut(tmp_path / 'a.png')
    with pytest.raises(SourceError, match=r'no picture in the folder .* ends early'):
        source.next_frame()
    (tmp_path / 'a.png').write_bytes(whole)
    assert colours(source, 1) == ['red']
    cut(tmp_path / 'a.png')
    with pytest.raises(SourceError, match=r'no picture in the folder .* can be decoded'):
        open_source(str(tmp_path), FOR_EVER, warn)


def test_pictures_of_different_sizes_are_stated_once(tmp_path, warn):
    for i, size in enumerate([(64, 48), (48, 64), (64, 48), (100, 50)]):
        write_picture(tmp_path / f'{i}.png', flat(RED, size))
    source = open_source(str(tmp_path), FOR_EVER, warn)
    shapes = [source.next_frame().shape[:2] for _ in range(8)]
    assert shapes == [(48, 64), (64, 48), (48, 64), (50, 100)] * 2
    (text,) = warn.texts('sizes of pictures')
    assert "'0.png' 64x48, '1.png' 48x64" in text


HALF_RED = np.concatenate([flat(RED, (40, 20)), flat(BLUE, (40, 20))])  # red above


@pytest.mark.parametrize(
    ('orientation', 'upright'),
    [(1, HALF_RED), (3, np.rot90(HALF_RED, 2)), (6, np.rot90(HALF_RED, -1)),
     (8, np.rot90(HALF_RED)), (2, HALF_RED[:, ::-1])],
)  # fmt: skip
def test_the_orientation_of_jpeg_and_tiff_is_obeyed(tmp_path, warn, orientation, upright):
    (tmp_path / 'a.jpg').write_bytes(jpeg_with_orientation(HALF_RED, orientation))
    (tmp_path / 'b.tif').write_bytes(tiff(HALF_RED, orientation))
    for name in ('a.jpg', 'b.tif'):
        frame = open_source(str(tmp_path / name), ONCE, warn).next_frame()
        assert frame.shape == upright.shape
        assert np.abs(frame.astype(int) - upright)[2:-2, 2:-2].mean() < 5


def test_sixteen_bits_alpha_palette_and_grey(tmp_path, warn):
    grey = np.tile(np.linspace(0, 255, 16).astype(np.uint8), (8, 1))
    deep = grey.astype(np.uint16) << 4  # 12 bits
    cv2.imwrite(str(tmp_path / 'deep.png'), deep)
    (tmp_path / 'deep.tif').write_bytes(tiff(deep))
    cv2.imwrite(str(tmp_path / 'grey.png'), grey)
    (tmp_path / 'palette.png').write_bytes(palette_png(grey, [(v, v, v) for v in range(256)]))
    alpha = np.dstack([grey, grey, grey, np.full_like(grey, 9)])
    cv2.imwrite(str(tmp_path / 'alpha.png'), alpha)
    for path in tmp_path.iterdir():
        frame = open_source(str(path), ONCE, warn).next_frame()
        assert np.array_equal(frame, np.dstack([grey] * 3)), path.name


def test_numbers_that_are_no_picture_are_refused(tmp_path, warn):
    (tmp_path / 'depth.tif').write_bytes(tiff(np.ones((8, 8), np.float32)))
    with pytest.raises(SourceError, match=r'depth\.tif'):
        open_source(str(tmp_path / 'depth.tif'), ONCE, warn)


@pytest.mark.skipif(
    not (hasattr(cv2, 'Animation') and hasattr(cv2, 'imwriteanimation')),
    reason='this OpenCV writes no animations',
)
@pytest.mark.parametrize('extension', ['.webp', '.png', '.gif'])
def test_an_animation_shows_all_its_pictures_for_their_times(tmp_path, warn, extension):
    animation = cv2.Animation()
    pictures = [cv2.cvtColor(flat(colour), cv2.COLOR_RGB2BGRA) for colour in (RED, GREEN, BLUE)]
    animation.frames, animation.durations = pictures, [40, 200, 0]
    path = str(tmp_path / f'a{extension}')
    assert cv2.imwriteanimation(path, animation)
    source = open_source(path, SourceOptions(loop=False), warn)
    assert '3 pictures' in source.summary
    shown_s = dict.fromkeys(('red', 'green', 'blue', 'end'), 0.0)
    for _ in range(20):
        (name,) = colours(source, 1)
        shown_s[name] += source.period_s
    assert shown_s['red'] == pytest.approx(0.04)
    assert shown_s['green'] == pytest.approx(0.2)
    assert shown_s['blue'] == pytest.approx(0.1)
    assert colours(open_source(path, FOR_EVER, warn), 4) == ['red', 'green', 'blue', 'red']


def test_film_in_rgb_at_its_own_rate_once_or_for_ever(tmp_path, warn):
    path = write_film(tmp_path / 'clip.avi', [flat(RED), flat(GREEN)], 12.0)
    once = open_source(path, SourceOptions(loop=False), warn)
    assert colours(once, 3) == ['red', 'green', 'end']
    assert once.period_s == pytest.approx(1 / 12)
    once.close()
    looped = open_source(path, SourceOptions(rate_hz=5.0), warn)
    assert colours(looped, 3) == ['red', 'green', 'red']
    assert looped.period_s == 0.2
    assert not warn


def test_a_film_that_claims_1000_pictures_a_second_is_bounded_with_a_warning(tmp_path, warn):
    path = write_film(tmp_path / 'fast.mp4', [flat(RED)] * 30, 1000.0, 'mp4v')
    source = open_source(path, SourceOptions(highest_rate_hz=50.0), warn)
    source.next_frame()
    assert source.period_s == pytest.approx(1 / 50)
    assert 'claims 1000 pictures/s: it is played at 50' in warn.texts('times')[0]


@pytest.mark.parametrize(
    ('claimed_hz', 'gap_ms', 'wait_s', 'warning'),
    [
        (30.0, 100 / 3, 1 / 30, None),
        (1000.0, 40.0, 0.04, None),  # a variable rate: the times count, not the claim
        (0.0, 500.0, 0.5, None),
        (1000.0, 1.0, 1 / 120, 'claims 1000'),
        (25.0, 0.0, 1 / 25, 'do not increase'),
        (1000.0, 0.0, 1 / 15, 'do not increase'),
        (float('nan'), -40.0, 1 / 15, 'do not increase'),
        (30.0, 3_600_000.0, 2.0, 'a gap of 3600.0 s'),
    ],
)
def test_the_pace_follows_the_times_of_the_pictures(warn, claimed_hz, gap_ms, wait_s, warning):
    times = FrameTimes('a.mp4', claimed_hz, SourceOptions(), warn)
    assert times.wait_s(1000.0, 1000.0 + gap_ms) == pytest.approx(wait_s)
    assert len(warn) == (warning is not None)
    assert (warning or '') in ''.join(warn.texts('times'))
    fixed = FrameTimes('a.mp4', claimed_hz, SourceOptions(rate_hz=7.0), warn)
    assert fixed.wait_s(1000.0, 1000.0 + gap_ms) == pytest.approx(1 / 7)


@pytest.mark.parametrize('extension', ['.avi', '.mkv'])
def test_a_half_downloaded_film_says_where_it_ends(tmp_path, warn, extension):
    noise = np.random.default_rng(0).integers(0, 255, (30, 48, 64, 3), np.uint8)
    path = write_film(tmp_path / f'clip{extension}', list(noise), 12.0)
    whole = open_source(path, SourceOptions(loop=False), warn)
    while whole.next_frame() is not None:
        pass
    assert not warn
    cut(path)
    source = open_source(path, SourceOptions(), warn)
    for _ in range(40):
        assert source.next_frame() is not None
    text = warn.texts('film')[0]
    assert 'ends early: nothing can be decoded after picture 1' in text
    assert 'of 2.5 s' in text


@pytest.mark.parametrize(
    ('name', 'reason'),
    [
        ('missing.png', 'no such file'),
        ('/dev/video99', 'no such device'),
        ('99', "camera '99' cannot be opened"),
        ('broken.png', 'cannot be read as a picture'),
        ('broken.mp4', 'cannot be read as a video'),
        ('empty', 'no pictures in the folder'),
        ('._a.png', "macOS stores about 'a.png'"),
        ('package://robot/film.mp4', 'an address begins with one of rtsp://'),
    ],
)
def test_what_gives_no_pictures_is_named_in_one_sentence(
    tmp_path, monkeypatch, warn, name, reason
):
    monkeypatch.chdir(tmp_path)
    for broken in ('broken.png', 'broken.mp4', '._a.png'):
        (tmp_path / broken).write_bytes(b'no picture at all')
    (tmp_path / 'empty').mkdir()
    with pytest.raises(SourceError, match=reason):
        open_source(name, SourceOptions(), warn)
