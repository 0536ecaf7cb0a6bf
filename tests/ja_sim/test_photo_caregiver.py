"""A caregiver who is played by the head of a photograph: the file, the scene, the pictures."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_common.core.geometry import directions_of_vectors
from ja_common.image_codec import decode_image
from ja_common.topics import IMAGE
from ja_sim.core.photo_head_file import PhotoHead, read_photo_head, write_photo_head
from ja_sim.core.scene import load_scene
from ja_sim.core.specs import CaregiverSpec
from ja_sim.core.world import JointAttentionWorld
from ja_sim.sim_node import SimNode

SMALL = (160, 120)
RED, BLUE = (230, 20, 20), (20, 20, 230)
EYES = np.array([[0.092, 0.0315, 0.088], [0.092, -0.0315, 0.088]])


def ball_head() -> PhotoHead:
    """Return a head that is a ball, its left half blue and its right half red."""
    yaw, pitch = np.meshgrid(np.linspace(0, 2 * np.pi, 33), np.linspace(-1.5, 1.5, 17))
    cosine = np.cos(pitch)
    ball = np.stack([cosine * np.cos(yaw), cosine * np.sin(yaw), np.sin(pitch)], axis=-1)
    vertices = (0.09 * ball + [0.03, 0.0, 0.07]).reshape(-1, 3)
    row, column = np.mgrid[:16, :32].reshape(2, -1)
    corner = 33 * row + column
    faces = np.vstack(
        [
            np.stack([corner, corner + 1, corner + 34], axis=1),
            np.stack([corner, corner + 34, corner + 33], axis=1),
        ]
    )
    # Her left, y > 0, is right in the picture.
    uv = np.stack([0.5 + 0.49 * ball[..., 1], 0.5 - 0.49 * ball[..., 2]], axis=-1).reshape(-1, 2)
    texture = np.zeros((64, 64, 3), np.uint8)
    texture[:, :32], texture[:, 32:] = RED, BLUE
    return PhotoHead(
        vertices.astype(np.float32),
        faces.astype(np.int32),
        uv.astype(np.float32),
        texture,
        EYES,
        np.array([0.107, 0.0, 0.07]),
        np.array([0.8, 0.6, 0.5]),
        np.array([0.1, 0.6, 0.1]),
    )


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    return write_photo_head(tmp_path / 'me.npz', ball_head())


@pytest.fixture
def make_world(photo: Path) -> Iterator[Callable[..., JointAttentionWorld]]:
    """Return a function that makes the default world with the photo and further settings."""
    worlds = []

    def make(seed: int = 0, **caregiver: object) -> JointAttentionWorld:
        scene = load_scene('default')
        settings = {'photo': str(photo), **caregiver}
        scene = replace(scene, caregiver=replace(scene.caregiver, **settings))
        worlds.append(JointAttentionWorld(scene, seed, SMALL))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()


def shares(picture: np.ndarray) -> tuple[float, float]:
    """Return the shares of a picture that are red and blue, as the head's halves."""
    red, _, blue = np.moveaxis(picture.astype(int), -1, 0)
    return float((red > 3 * blue + 20).mean()), float((blue > 3 * red + 20).mean())


def test_a_head_survives_its_file(photo: Path) -> None:
    head, read = ball_head(), read_photo_head(photo)
    for name, value in vars(head).items():
        np.testing.assert_array_equal(value, getattr(read, name))
        assert getattr(read, name).dtype == value.dtype


def test_the_photo_is_where_her_face_is_and_turns_with_her_head(make_world: Callable) -> None:
    world = make_world()
    straight = world.render_picture(np.zeros(2))
    middle = straight[50:70]
    red, blue = shares(middle[:, :80])[0], shares(middle[:, 80:])[1]
    assert red == pytest.approx(blue, abs=0.03)
    assert red > 0.1
    assert shares(middle[:, 90:])[0] == 0.0, 'her right half is left in the picture'
    # A head that turns to her left, right in the picture, shows more of its right half.
    to_her_left = shares(world.render_picture(np.radians([40.0, 0.0])))
    to_her_right = shares(world.render_picture(np.radians([-40.0, 0.0])))
    assert to_her_left[0] > 1.5 * to_her_left[1]
    assert to_her_right[1] > 1.5 * to_her_right[0]


def test_lids_and_eyes_of_the_simulator_do_not_show(make_world: Callable) -> None:
    world = make_world()
    open_eyes = world.render_picture(np.zeros(2), eyes_closed=False)
    closed = world.render_picture(np.zeros(2), eyes_closed=True)
    aside = world.render_picture(np.zeros(2), eyes=np.full((2, 2), 0.4))
    np.testing.assert_array_equal(open_eyes, closed)
    np.testing.assert_array_equal(open_eyes, aside)


def test_her_head_takes_the_whole_gaze(make_world: Callable) -> None:
    world = make_world(head_share=(0.5, 0.6), head_noise_deg=0.0, gaze_noise_deg=0.0)
    for _ in range(12):
        world.step(0.1)
    truth = world.truth()
    assert truth.attended >= 0
    # In her rest frame x points to the robot: half a turn about z from the base frame.
    eyes = truth.face_position + np.array([0.107 - EYES[0, 0], 0.0, 0.018])
    gaze = directions_of_vectors((truth.gaze_target - eyes) * [-1.0, -1.0, 1.0])
    np.testing.assert_allclose(truth.head, gaze, atol=np.radians(4))
    assert np.hypot(*truth.head) > np.radians(10)


def test_other_people_have_eyes_that_turn(make_world: Callable) -> None:
    world = make_world(photo='')
    straight = world.render_picture(np.zeros(2), eyes_closed=False)
    aside = world.render_picture(np.zeros(2), False, np.full((2, 2), 0.4))
    assert (straight != aside).any()
    assert CaregiverSpec().photo == ''


def test_the_world_repeats(make_world: Callable) -> None:
    pictures = []
    for _ in range(2):
        world = make_world(seed=4)
        world.step(0.1)
        pictures.append(world.observe().image)
    np.testing.assert_array_equal(*pictures)


def test_a_scene_names_the_photo_beside_it(photo: Path) -> None:
    path = photo.with_name('mine.yaml')
    path.write_text('caregiver: {photo: me.npz, distance_m: 1}\n')
    assert load_scene(str(path)).caregiver.photo == str(photo)
    path.write_text(f'caregiver: {{photo: {photo}}}\n')
    assert load_scene(str(path)).caregiver.photo == str(photo)


def test_a_missing_file_is_named(tmp_path: Path, make_world: Callable) -> None:
    with pytest.raises(ConfigError, match='no such file'):
        make_world(photo=str(tmp_path / 'other.npz'))


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        ({'faces': np.array([[0, 1, 9999]] * 4, np.int32)}, 'faces'),
        ({'faces': np.zeros((4, 3))}, 'faces is float64'),
        ({'vertices': np.full((10, 3), np.nan, np.float32)}, 'vertices is not finite'),
        ({'vertices': np.full((600, 3), 3.0, np.float32)}, 'vertices'),
        ({'texture': np.zeros((4, 4, 3), np.uint8)}, 'texture'),
        ({'texture': np.zeros((64, 64), np.uint8)}, 'texture'),
        ({'uv': np.full((3, 2), 0.5, np.float32)}, 'uv'),
        ({'skin': np.array([2.0, 0.0, 0.0])}, 'colours'),
        ({'eyes': np.zeros(3)}, 'eyes'),
    ],
)
def test_a_file_that_holds_no_usable_head_is_refused(
    tmp_path: Path, change: dict, reason: str
) -> None:
    path = write_photo_head(tmp_path / 'bad.npz', replace(ball_head(), **change))
    with pytest.raises(ConfigError, match=reason) as caught:
        read_photo_head(path)
    assert str(path) in str(caught.value)
    assert 'make it again' in str(caught.value)


def test_a_file_that_is_no_archive_is_refused(tmp_path: Path, photo: Path) -> None:
    text, cut, other = tmp_path / 'text.npz', tmp_path / 'cut.npz', tmp_path / 'other.npz'
    text.write_text('hello')
    cut.write_bytes(photo.read_bytes()[:2000])
    np.savez(other, format=1, vertices=np.zeros(3))
    for path in (text, cut, other):
        with pytest.raises(ConfigError, match='holds no head of a photograph'):
            read_photo_head(path)


def test_a_file_of_another_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'newer.npz'
    np.savez(path, format=99, **vars(ball_head()))
    with pytest.raises(ConfigError, match='format is not 1'):
        read_photo_head(path)


def test_an_archive_that_expands_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'large.npz'
    np.savez_compressed(path, format=1, texture=np.zeros((8200, 8200), np.uint8))
    with pytest.raises(ConfigError, match='unpacks to'):
        read_photo_head(path)


def test_the_node_shows_the_photo(photo: Path, make_bench: Callable) -> None:
    size = {'image_width': SMALL[0], 'image_height': SMALL[1]}
    bench = make_bench(SimNode, [], [IMAGE], scene='easy', photo=str(photo), **size)
    bench.wait(lambda: bench.messages(IMAGE))
    picture = decode_image(bench.messages(IMAGE)[0])
    # She looks at the robot: both halves of her face show.
    assert min(shares(picture[50:70, 50:110])) > 0.1
