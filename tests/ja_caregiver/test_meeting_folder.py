"""What a meeting leaves in its folder, and what happens when the disk is full."""

import cv2
import numpy as np
import pytest

from ja_caregiver.core.meeting import Meeting, MeetingTrial, load_meeting
from ja_caregiver.core.meeting_folder import MeetingFolder, crop_around
from ja_common.core.files import SaveError

TRIAL = MeetingTrial(1, 10**9, 2, {1: (0.1, 0.2), 2: (-0.1, 0.2)}, 1, 2, True)
MEETING = Meeting('2026-01-02T03:04:05+0000', 'webcam', 7, trials=(TRIAL,))


def picture(width=640, height=480):
    return np.full((height, width, 3), (200, 30, 30), np.uint8)


def test_meeting_and_pictures_are_written(tmp_path):
    folder = MeetingFolder(tmp_path)
    name = folder.add_picture('001_view', picture())
    folder.set_meeting(MEETING)
    folder.save()
    assert load_meeting(tmp_path / 'meeting.json') == MEETING
    found = cv2.imread(str(tmp_path / name))
    assert found.shape == (360, 480, 3)
    assert abs(int(found[100, 100, 2]) - 200) < 10  # red stays red
    assert (tmp_path / name).stat().st_size < 20_000


def test_a_picture_is_kept_as_it_was_when_it_was_added(tmp_path):
    folder, pixels = MeetingFolder(tmp_path), picture(100, 80)
    name = folder.add_picture('a', pixels)
    pixels[:] = 0
    folder.save()
    assert cv2.imread(str(tmp_path / name)).mean() > 50


def test_the_report_is_written_once_after_the_end(tmp_path):
    calls = []

    def write_report(meeting, where):
        calls.append((meeting, where))
        return where / 'report.html'

    folder = MeetingFolder(tmp_path, write_report)
    folder.set_meeting(MEETING)
    folder.save()
    assert calls == []
    ended = Meeting('x', 'film', 0, ended='stopped', trials=(TRIAL,))
    folder.set_meeting(ended)
    folder.save()
    folder.save()
    assert calls == [(ended, tmp_path)]
    assert folder.report == str(tmp_path / 'report.html')


def test_a_process_that_ends_leaves_the_report_out(tmp_path):
    folder = MeetingFolder(tmp_path, lambda meeting, where: pytest.fail('no report now'))
    folder.leave_out_report()
    folder.set_meeting(Meeting('x', 'film', 0, ended='stopped'))
    folder.save()


def test_what_cannot_be_written_stays_queued_within_bounds(tmp_path):
    place = tmp_path / 'meeting'
    place.write_text('a file in the place of the folder')
    folder = MeetingFolder(place)
    for number in range(300):
        folder.add_picture(f'{number:03}_view', picture(8, 6))
    folder.set_meeting(MEETING)
    with pytest.raises(SaveError):
        folder.save()
    place.unlink()
    folder.save()
    assert load_meeting(place / 'meeting.json') == MEETING
    assert len(list((place / 'pictures').iterdir())) == 200
    assert (place / 'pictures' / '299_view.jpg').exists()


@pytest.mark.parametrize(
    ('centre', 'size', 'shape'),
    [
        ((50, 40), (20, 10), (10, 20)),
        ((0, 0), (20, 10), (5, 10)),
        ((50, 40), (1e9, 1e9), (80, 100)),
        ((500, 40), (20, 10), (80, 100)),  # nothing of it is in the picture
        ((float('nan'), 40), (20, 10), (80, 100)),
        ((float('inf'), 40), (20, float('nan')), (80, 100)),
    ],
)
def test_crop(centre, size, shape):
    assert crop_around(picture(100, 80), centre, size).shape[:2] == shape
