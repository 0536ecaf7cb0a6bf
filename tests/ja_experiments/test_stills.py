"""Stills of a face whose names or table state where it looks become looks of the experiments."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_experiments.datasets.stills import list_stills, load_stills, thing_direction
from still_pictures import write_stills

HEADER = 'file,person,distance_m,head_pan,head_tilt,gaze_pan,gaze_tilt\n'


@pytest.fixture(scope='module')
def folder(tmp_path_factory) -> Path:
    """Make a folder of stills."""
    folder = tmp_path_factory.mktemp('stills')
    write_stills(folder)
    return folder


def test_names_state_person_distance_pose_and_gaze(tmp_path: Path):
    for name in ('0007_2m_-15P_10V_-5H.jpg', 'notes.txt', 'holiday.jpg', '1_0m_0P_0V_0H.jpg'):
        (tmp_path / name).touch()
    (still,) = list_stills(tmp_path)
    assert (still.person, still.distance_m) == ('0007', 2.0)
    assert still.head == pytest.approx(np.radians([-15, 0]))
    assert still.gaze == pytest.approx(np.radians([-5, -10]))


def test_a_table_states_the_same(tmp_path: Path):
    (tmp_path / 'stills.csv').write_text(HEADER + 'a.jpg,anna,1.5,10,-5,20,-4\n')
    (still,) = list_stills(tmp_path)
    assert still.path == tmp_path / 'a.jpg'
    assert still.gaze == pytest.approx(np.radians([20, -4]))


@pytest.mark.parametrize(
    ('table', 'message'),
    [
        ('', 'lacks the columns file'),
        (HEADER, 'holds no stills'),
        (HEADER + 'a.jpg,anna,1.5,10,-5,20\n', r"stills\.csv:2: gaze_tilt = '' is no number"),
        (HEADER + 'a.jpg,anna,0,10,-5,20,1\n', 'distance_m = 0 is outside'),
        (HEADER + 'a.jpg,anna,1,10,-5,nan,1\n', 'outside'),
        (HEADER + '../a.jpg,anna,1,10,-5,2,1\n', 'no file in this folder'),
        (HEADER + ',anna,1,10,-5,2,1\n', 'no file in this folder'),
    ],
)
def test_a_table_with_a_mistake_is_refused(tmp_path: Path, table, message):
    (tmp_path / 'stills.csv').write_text(table)
    with pytest.raises(ConfigError, match=message):
        list_stills(tmp_path)


def test_a_folder_without_stills_is_refused(tmp_path: Path):
    for place in (tmp_path, tmp_path / 'missing'):
        with pytest.raises(ConfigError):
            list_stills(place)


def test_the_thing_lies_on_the_line_of_gaze():
    distance, thing_at = 2.0, 0.4
    pan, tilt = thing_direction((0.2, 0.0), thing_at)
    thing = thing_at * distance * np.array([np.cos(pan), np.sin(pan)])
    seen_from_her = thing - [distance, 0.0]
    assert np.arctan2(seen_from_her[1], -seen_from_her[0]) == pytest.approx(0.2)
    assert tilt == 0.0
    assert thing_direction((0.0, 0.0)) == pytest.approx([0, 0])
    assert np.isfinite(thing_direction((1.2, -0.9))).all()


def test_faces_are_cut_as_the_robot_cuts_them(folder: Path):
    (looks,) = load_stills(folder).values()
    assert looks.faces.shape == (27, 30, 25)
    assert looks.faces.dtype == np.uint8
    assert all(face.std() > 10 for face in looks.faces)
    assert np.isnan(looks.gazes).all()
    assert looks.object_distances == pytest.approx(np.full(27, 0.48))


def test_landmarks_are_read_and_follow_the_stated_pose(folder: Path):
    (looks,) = load_stills(folder, reads_gaze=True).values()
    known = np.isfinite(looks.gazes[:, 0])
    assert known.mean() > 0.7
    yaw = looks.gazes[known, 0]
    assert np.corrcoef(yaw, looks.directions[known, 0])[0, 1] > 0.9


def test_stills_without_a_face_or_picture_are_left_out_with_a_sentence(tmp_path: Path):
    cv2.imwrite(str(tmp_path / '1_1m_0P_0V_5H.png'), np.full((120, 160, 3), 90, np.uint8))
    (tmp_path / '1_1m_0P_0V_10H.png').write_text('no picture')
    texts: list[str] = []
    with pytest.raises(ConfigError, match='no face is found in any'):
        load_stills(tmp_path, texts.append)
    assert len(texts) == 2
    assert all('left out' in text for text in texts)
