"""Face detectors behind their one interface, on drawn faces."""

import cv2
import numpy as np
import pytest

from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.box import Box
from ja_perception.core.faces import Face, cut_square, suppress_non_maxima
from ja_perception.core.haar import HaarFaces
from ja_perception.core.template_faces import TemplateFaces
from synthetic_pictures import draw_ball, draw_face, room

WHOLE = Box(159.5, 119.5, 320, 320)


@pytest.fixture(scope='module')
def blazeface():
    return BlazeFace()


def caregiver(u=150, v=110, width=80, look=0.0):
    picture = room()
    draw_face(picture, u, v, width, look)
    return picture


@pytest.mark.parametrize('width', [45, 80, 120])
def test_blazeface_finds_box_and_eyes(blazeface, width):
    (face,) = blazeface.find_faces(caregiver(width=width), WHOLE)
    assert face.score > 0.7
    assert face.box.u == pytest.approx(150, abs=0.05 * width)
    assert face.box.width == pytest.approx(width, rel=0.2)
    right_eye, left_eye = face.keypoints[:2]
    assert right_eye == pytest.approx([150 - 0.2 * width, 110 - 0.12 * width], abs=0.1 * width)
    assert left_eye == pytest.approx([150 + 0.2 * width, 110 - 0.12 * width], abs=0.1 * width)


def test_box_is_the_same_in_any_square_that_shows_the_face(blazeface):
    (wide,) = blazeface.find_faces(caregiver(), WHOLE)
    (close,) = blazeface.find_faces(caregiver(), Box(140, 120, 200, 200))
    assert (close.box.u, close.box.v) == pytest.approx((wide.box.u, wide.box.v), abs=5)


def test_square_may_reach_beyond_the_image_and_lie_outside(blazeface):
    (face,) = blazeface.find_faces(caregiver(u=30, v=40), Box(20, 30, 200, 200))
    assert face.box.u == pytest.approx(30, abs=6)
    assert blazeface.find_faces(caregiver(), Box(-900, 0, 100, 100)) == []


def test_two_faces(blazeface):
    picture = caregiver(u=80, width=70)
    draw_face(picture, 240, 120, 70)
    assert sorted(round(f.box.u, -1) for f in blazeface.find_faces(picture, WHOLE)) == [80, 240]


@pytest.mark.parametrize('finder', [BlazeFace, HaarFaces, lambda: TemplateFaces(BlazeFace())])
def test_no_face_in_a_room_with_a_ball(finder):
    picture = room()
    draw_ball(picture, 100, 100, 40)
    assert finder().find_faces(picture, WHOLE) == []


def test_haar_finds_a_frontal_face():
    picture = cv2.GaussianBlur(caregiver(width=100), (0, 0), 2)
    (face,) = HaarFaces().find_faces(picture, WHOLE)
    assert face.box.u == pytest.approx(150, abs=10)
    assert 0.6 <= face.score <= 1


def test_template_learns_the_first_face_and_finds_it_elsewhere_and_larger(blazeface):
    finder = TemplateFaces(blazeface)
    assert finder.find_faces(room(), WHOLE) == []
    finder.find_faces(caregiver(), WHOLE)
    (face,) = finder.find_faces(caregiver(u=220, v=150, width=100), WHOLE)
    assert (face.box.u, face.box.v) == pytest.approx((220, 160), abs=10)
    assert face.box.width == pytest.approx(100, rel=0.15)
    assert finder.find_faces(room(), WHOLE) == []


def test_cut_square_scales_and_pads_with_black():
    picture = np.full((40, 60, 3), 200, np.uint8)
    look = cut_square(picture, Box(-0.5, 19.5, 40, 40), 20)
    assert look.shape == (20, 20, 3)
    assert not look[:, :10].any()
    assert np.all(look[:, 10:] == 200)


def test_of_doubles_the_more_confident_stays():
    nothing = np.empty((0, 2))
    sure = Face(Box(50, 50, 20, 20), 0.9, nothing)
    unsure = Face(Box(52, 51, 22, 22), 0.6, nothing)
    other = Face(Box(90, 50, 20, 20), 0.5, nothing)
    assert suppress_non_maxima([unsure, other, sure]) == [sure, other]
