"""Pictures from files, folders and devices; clear sentences when there are none."""

import cv2
import numpy as np
import pytest

from ja_perception.core.frame_sources import SourceError, open_source

RED, GREEN = (200, 0, 0), (0, 200, 0)


def flat(colour):
    return np.full((48, 64, 3), colour, np.uint8)


def write(path, picture):
    assert cv2.imwrite(str(path), picture[..., ::-1])
    return str(path)


@pytest.fixture
def video(tmp_path):
    path = tmp_path / 'clip.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 12.0, (64, 48))
    assert writer.isOpened()
    for colour in (RED, GREEN):
        writer.write(flat(colour)[..., ::-1].copy())
    writer.release()
    return str(path)


def names(source, count):
    """Return the colour of each of the next frames."""
    frames = [source.next_frame() for _ in range(count)]
    return ['end' if f is None else 'red' if f[0, 0, 0] > 100 else 'green' for f in frames]


def test_single_image_never_ends(tmp_path):
    source = open_source(write(tmp_path / 'a.png', flat(RED)), loop=False, still_frames=1)
    assert names(source, 3) == ['red'] * 3
    assert source.rate_hz is None


def test_folder_shows_each_picture_for_a_while_in_the_order_of_names(tmp_path):
    write(tmp_path / 'b.png', flat(GREEN))
    write(tmp_path / 'a.jpg', flat(RED))
    (tmp_path / 'notes.txt').write_text('no picture')
    source = open_source(str(tmp_path), loop=False, still_frames=2)
    assert names(source, 5) == ['red', 'red', 'green', 'green', 'end']
    looped = open_source(str(tmp_path), loop=True, still_frames=1)
    assert names(looped, 3) == ['red', 'green', 'red']


def test_video_in_rgb_at_its_own_rate_once_or_for_ever(video):
    once = open_source(video, loop=False, still_frames=1)
    assert once.rate_hz == pytest.approx(12.0)
    assert names(once, 3) == ['red', 'green', 'end']
    once.close()
    assert names(open_source(video, loop=True, still_frames=1), 3) == ['red', 'green', 'red']


@pytest.mark.parametrize(
    ('name', 'reason'),
    [
        ('missing.png', 'no such file'),
        ('/dev/video99', 'no such device'),
        ('99', "camera '99' cannot be opened"),
        ('broken.png', 'cannot be read as a picture'),
        ('broken.mp4', 'cannot be read as a video'),
        ('empty', 'no pictures in the folder'),
    ],
)
def test_what_gives_no_pictures_is_told_in_one_sentence(tmp_path, monkeypatch, name, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'broken.png').write_bytes(b'no picture at all')
    (tmp_path / 'broken.mp4').write_bytes(b'no video at all')
    (tmp_path / 'empty').mkdir()
    with pytest.raises(SourceError, match=reason):
        open_source(name, loop=True, still_frames=1)
