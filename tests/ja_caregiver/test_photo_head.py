"""A head from a photograph. The photographs are pictures of the simulator's own people."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ja_caregiver.core.head_outline import find_outline
from ja_caregiver.core.photo_face import (
    EYES_APART_PX,
    LEFT_EYE,
    MIDDLE_OF_EYES_PX,
    RIGHT_EYE,
    PhotoError,
    PhotoFace,
    PhotoFaceFinder,
)
from ja_caregiver.core.photo_head import EYES_APART_M, make_photo_head, photo_head
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.face_tracking import search_square, whole_square
from ja_sim.core.photo_head_file import PhotoHead, read_photo_head
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld
from picture_files import jpeg_with_orientation, write_picture
from synthetic_pictures import room

FINDER = PhotoFaceFinder()
PERSON = 'efua'

Render = Callable[..., np.ndarray]


@pytest.fixture(scope='module')
def render() -> Iterator[Render]:
    """Return photographs of a person whose head is turned by (yaw, pitch) [deg]."""
    scene = load_scene('default')
    scene = replace(
        scene,
        caregiver=replace(scene.caregiver, identity=PERSON),
        objects=replace(scene.objects, count=1),
    )
    world = JointAttentionWorld(scene, 3, (800, 600))
    yield lambda *turned: world.render_picture(np.radians(turned or (0.0, 0.0)), False)
    world.close()


@pytest.fixture(scope='module')
def photograph(render: Render) -> np.ndarray:
    return render()


@pytest.fixture(scope='module')
def face(photograph: np.ndarray) -> PhotoFace:
    return FINDER.find_face(photograph)


@pytest.fixture(scope='module')
def head(face: PhotoFace) -> PhotoHead:
    return photo_head(face)


def eyes(face: PhotoFace) -> np.ndarray:
    """Return the middle (2, 2) [px] of her right and her left eye in the cut."""
    return np.stack(
        [face.landmarks[list(each), :2].mean(axis=0) for each in (RIGHT_EYE, LEFT_EYE)]
    )


def test_the_cut_shows_the_eyes_level_and_at_one_size(face: PhotoFace) -> None:
    right, left = eyes(face)
    np.testing.assert_allclose((right + left) / 2, MIDDLE_OF_EYES_PX, atol=2)
    assert left[0] - right[0] == pytest.approx(EYES_APART_PX, rel=0.04)
    assert abs(left[1] - right[1]) < 2
    assert np.abs(np.degrees(face.pose.angles)).max() < 8


@pytest.mark.parametrize('roll_deg', [-30, 20])
def test_a_tilted_photograph_is_set_upright(
    photograph: np.ndarray, face: PhotoFace, roll_deg: float
) -> None:
    turn = cv2.getRotationMatrix2D((400, 300), roll_deg, 1.0)
    tilted = cv2.warpAffine(photograph, turn, (800, 600), borderMode=cv2.BORDER_REPLICATE)
    found = FINDER.find_face(np.asarray(tilted, np.uint8))
    np.testing.assert_allclose(eyes(found), eyes(face), atol=4)
    assert not found.inside.all()


@pytest.mark.parametrize('suffix', ['png', 'jpg', 'bmp', 'webp', 'tiff'])
def test_common_picture_files_are_read(
    photograph: np.ndarray, face: PhotoFace, tmp_path: Path, suffix: str
) -> None:
    small = cv2.resize(photograph, None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA)
    path = write_picture(tmp_path / f'me.{suffix}', np.asarray(small))
    np.testing.assert_allclose(eyes(FINDER.read_photo(Path(path))), eyes(face), atol=3)


def test_a_photograph_from_a_phone_held_sideways_is_turned(
    photograph: np.ndarray, face: PhotoFace, tmp_path: Path
) -> None:
    path = tmp_path / 'me.jpg'
    path.write_bytes(jpeg_with_orientation(np.rot90(photograph).copy(), 6))
    np.testing.assert_allclose(eyes(FINDER.read_photo(path)), eyes(face), atol=3)


def test_the_outline_holds_face_hair_and_neck_but_no_wall(
    face: PhotoFace, photograph: np.ndarray
) -> None:
    outline = find_outline(face)
    rows, columns = np.flatnonzero(outline.head.any(axis=1)), np.flatnonzero(outline.head.any(0))
    chin, forehead = face.landmarks[152, 1], face.landmarks[10, 1]
    assert rows[0] < forehead - 15
    assert chin + 20 < rows[-1] < chin + EYES_APART_PX
    assert 1.8 < np.ptp(columns) / EYES_APART_PX < 3.2
    assert outline.head[int(chin) - 5, 360]
    assert not outline.head[:80].any()
    assert outline.head[outline.shown].all()


def test_the_head_has_human_size_and_stands_in_the_rest_frame(head: PhotoHead) -> None:
    left, right = head.eyes
    assert np.linalg.norm(left - right) == pytest.approx(EYES_APART_M, abs=1e-6)
    assert left[1] > 0 > right[1], 'y points to her left'
    np.testing.assert_allclose((left + right) / 2, [0.092, 0.0, 0.088], atol=1e-3)
    wide, tall = np.ptp(head.vertices[:, 1]), np.ptp(head.vertices[:, 2])
    deep = np.ptp(head.vertices[:, 0])
    assert 0.12 < wide < 0.24
    assert 0.2 < tall < 0.32
    assert 0.17 < deep < 0.27
    nose = head.vertices[head.vertices[:, 0].argmax()]
    assert abs(nose[1]) < 0.012, 'what is nearest to the robot is the nose'
    assert -0.06 < nose[2] - left[2] < -0.015


def test_the_surface_looks_outwards(head: PhotoHead) -> None:
    a, b, c = (head.vertices[head.faces[:, k]].astype(float) for k in range(3))
    normal, middle = np.cross(b - a, c - a), (a + b + c) / 3
    volume = (normal * (middle - head.vertices.mean(axis=0))).sum() / 6
    assert 0.002 < volume < 0.008, 'some litres; negative if the faces were inside out'
    face = (np.abs(middle[:, 1]) < 0.03) & (middle[:, 0] > 0.08)
    assert (normal[face, 0] > 0).mean() > 0.98


def test_her_left_half_has_the_colours_of_the_right_half_of_the_photograph(
    photograph: np.ndarray,
) -> None:
    tinted = photograph.copy()
    tinted[:, 400:, 0] = tinted[:, 400:, 0] // 2
    head = photo_head(FINDER.find_face(tinted))
    height, width = head.texture.shape[:2]
    column, row = (head.uv * [width - 1, height - 1]).round().astype(int).T
    cheeks = (head.vertices[:, 0] > 0.06) & (np.abs(head.vertices[:, 1]) > 0.02)
    red = head.texture[row, column, 0] / np.maximum(head.texture[row, column, 1], 1)
    hers = head.vertices[:, 1] > 0
    assert red[cheeks & hers].mean() < 0.75 * red[cheeks & ~hers].mean()


def test_the_same_photograph_gives_the_same_head(head: PhotoHead, photograph: np.ndarray) -> None:
    again = photo_head(FINDER.find_face(photograph))
    for name, value in vars(head).items():
        np.testing.assert_array_equal(value, getattr(again, name))


def test_a_head_that_was_turned_a_little_looks_straight_ahead(render: Render) -> None:
    head = photo_head(FINDER.find_face(render(12.0, 0.0)))
    nose = head.vertices[head.vertices[:, 0].argmax()]
    assert abs(nose[1]) < 0.015


def test_a_head_survives_its_file(photograph: np.ndarray, head: PhotoHead, tmp_path: Path) -> None:
    photo = Path(write_picture(tmp_path / 'me.png', photograph))
    made = make_photo_head(photo, tmp_path / 'me.npz', FINDER)
    read = read_photo_head(tmp_path / 'me.npz')
    for name, value in vars(head).items():
        np.testing.assert_array_equal(value, getattr(made, name))
        np.testing.assert_array_equal(value, getattr(read, name))
        assert getattr(read, name).dtype == value.dtype


def test_it_is_found_when_turned_and_shown_where_it_is_turned(
    head: PhotoHead, photograph: np.ndarray, tmp_path: Path
) -> None:
    photo = Path(write_picture(tmp_path / 'me.png', photograph))
    make_photo_head(photo, tmp_path / 'me.npz', FINDER)
    scene = load_scene('default')
    caregiver = replace(scene.caregiver, photo=str(tmp_path / 'me.npz'))
    world, finder = JointAttentionWorld(replace(scene, caregiver=caregiver), 0), BlazeFace()
    whole, noses = whole_square(320, 240), []
    for yaw in (-45, -30, -15, 0, 15, 30, 45):
        picture = world.render_picture(np.radians([yaw, 0.0]), False)
        (found,) = finder.find_faces(picture, whole)[:1] or [None]
        assert found is not None, f'turned by {yaw} degrees'
        framed = finder.find_faces(picture, search_square(found.box, whole))
        assert framed
        eyes, nose = framed[0].keypoints[:2].mean(axis=0), framed[0].keypoints[2]
        noses.append((nose - eyes)[0] / framed[0].box.width)
    world.close()
    # Her left is right in the picture.
    assert (np.diff(noses) > 0).all()
    assert abs(noses[3]) < 0.05


def small(picture: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.resize(picture, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA))


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        (lambda picture: room(), 'no face is found'),
        (lambda picture: np.hstack([picture, picture]), 'shows 2 faces'),
        (small, 'pixels wide'),
    ],
)
def test_a_picture_of_which_no_head_can_be_made_is_refused_in_one_sentence(
    photograph: np.ndarray, tmp_path: Path, change: Callable, reason: str
) -> None:
    path = write_picture(tmp_path / 'other.png', change(photograph))
    with pytest.raises(PhotoError, match=reason) as caught:
        FINDER.read_photo(Path(path))
    assert 'other.png' in str(caught.value)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('turned', [(35.0, 0.0), (-40.0, 5.0)])
def test_a_face_that_is_turned_aside_is_refused(render: Render, turned: tuple) -> None:
    with pytest.raises(PhotoError, match=r'is turned by .* looks at the camera'):
        FINDER.find_face(render(*turned))


def test_what_is_no_picture_is_refused(tmp_path: Path) -> None:
    text = tmp_path / 'me.jpg'
    text.write_text('not a picture')
    for path, reason in ((text, 'picture'), (tmp_path, 'folder'), (tmp_path / 'no', 'no such')):
        with pytest.raises(PhotoError, match=reason):
            FINDER.read_photo(path)
