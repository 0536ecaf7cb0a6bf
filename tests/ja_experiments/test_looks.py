"""Looks are rendered once and cached, and rendered again when the cache is not valid."""

import json
from pathlib import Path

import numpy as np
import pytest

from ja_common.core.face_gaze import FaceGaze
from ja_experiments.datasets.looks import Looks, load_looks


class Renderer:
    """A stand-in for the renderer that counts its calls."""

    def __init__(self, looks: Looks) -> None:
        self.looks = looks
        self.times = 0

    def __call__(self, *_: object) -> Looks:
        self.times += 1
        return self.looks


@pytest.fixture
def renderer(looks: Looks) -> Renderer:
    return Renderer(looks)


def load(folder: Path, renderer: Renderer, lines: list[str], seed: int = 0) -> Looks:
    return load_looks(seed=seed, count=125, folder=folder, report=lines.append, render=renderer)


def test_looks_are_cached(tmp_path: Path, renderer: Renderer) -> None:
    lines: list[str] = []
    first, second = load(tmp_path, renderer, lines), load(tmp_path, renderer, lines)
    np.testing.assert_array_equal(first.faces, second.faces)
    np.testing.assert_array_equal(first.directions, second.directions)
    assert renderer.times == 1
    assert len(lines) == 1
    assert 'none are cached' in lines[0]


def test_another_seed_has_its_own_looks(tmp_path: Path, renderer: Renderer) -> None:
    load(tmp_path, renderer, [])
    load(tmp_path, renderer, [], seed=1)
    load(tmp_path, renderer, [])
    assert renderer.times == 2


def damage_data(kept: Path) -> None:
    path = kept / 'looks.npz'
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def cut_data(kept: Path) -> None:
    path = kept / 'looks.npz'
    path.write_bytes(path.read_bytes()[:100])


def cut_manifest(kept: Path) -> None:
    (kept / 'manifest.json').write_text('{"sha256": ')


def other_manifest(kept: Path) -> None:
    (kept / 'manifest.json').write_text('[]')


def older_sources(kept: Path) -> None:
    path = kept / 'manifest.json'
    manifest = json.loads(path.read_text())
    manifest['made_by']['sources'] = 'of yesterday'
    path.write_text(json.dumps(manifest))


@pytest.mark.parametrize(
    ('spoil', 'reason'),
    [
        (damage_data, 'damaged'),
        (cut_data, 'damaged'),
        (cut_manifest, 'cannot be read'),
        (other_manifest, 'cannot be read'),
        (older_sources, 'made with other sources'),
    ],
)
def test_looks_that_cannot_be_used_are_rendered_again_with_one_line(
    tmp_path: Path, renderer: Renderer, spoil: object, reason: str
) -> None:
    load(tmp_path, renderer, [])
    (kept,) = tmp_path.iterdir()
    spoil(kept)  # type: ignore[operator]
    lines: list[str] = []
    load(tmp_path, renderer, lines)
    assert renderer.times == 2
    assert len(lines) == 1
    assert reason in lines[0]
    load(tmp_path, renderer, lines)
    assert renderer.times == 2, 'the new looks are cached'


def test_rendered_looks_show_where_she_looks(tmp_path: Path) -> None:
    """Her face turns with the attended object, through the real world, detector and crop."""
    found = load_looks(count=8, folder=tmp_path, report=lambda line: None)
    again = load_looks(count=8, folder=tmp_path / 'elsewhere', report=lambda line: None)
    np.testing.assert_array_equal(found.faces, again.faces)
    assert found.faces.shape == (8, 30, 25)
    assert len(np.unique(found.directions, axis=0)) == 8
    # The head points at her face, 1.2 m straight ahead.
    assert np.abs(found.postures).max() < np.radians(4)
    assert np.ptp(found.directions[:, 0]) > np.radians(30)
    assert all(face.std() > 10 for face in found.faces)


def test_looks_without_senses_have_nothing_measured(looks: Looks) -> None:
    assert looks.gazes.shape == (125, 9)
    assert looks.face_ranges.shape == looks.object_ranges.shape == (125, 2)
    assert looks.face_distances.shape == looks.object_distances.shape == (125,)
    for name in ('gazes', 'face_ranges', 'object_ranges', 'face_distances', 'object_distances'):
        assert np.isnan(getattr(looks, name)).all()
        assert len(getattr(looks[:20], name)) == 20


def test_senses_and_image_size_have_their_own_looks(tmp_path: Path, renderer: Renderer) -> None:
    orders: list[dict] = [
        {},
        {'senses': True},
        {'image_size': (640, 480)},
        {'senses': True, 'image_size': (640, 480)},
    ]
    for _ in range(2):
        for order in orders:
            load_looks(
                count=125, folder=tmp_path, report=lambda line: None, render=renderer, **order
            )
    assert renderer.times == len(orders), 'each is rendered once and then cached'
    assert {path.name for path in tmp_path.iterdir()} == {
        'looks-default-0-125',
        'looks-default-0-125-senses',
        'looks-default-0-125-640x480',
        'looks-default-0-125-senses-640x480',
    }
    manifest = json.loads(
        (tmp_path / 'looks-default-0-125-senses-640x480' / 'manifest.json').read_text()
    )
    assert manifest['made_by']['senses'] is True
    assert manifest['made_by']['image_size'] == [640, 480]


def test_looks_with_senses_that_are_copied_to_the_others_name_are_not_used(
    tmp_path: Path, renderer: Renderer
) -> None:
    load_looks(count=125, folder=tmp_path, report=lambda line: None, render=renderer, senses=True)
    (kept,) = tmp_path.iterdir()
    kept.rename(tmp_path / 'looks-default-0-125')
    lines: list[str] = []
    load(tmp_path, renderer, lines)
    assert renderer.times == 2
    assert 'made with other senses' in lines[0]


def test_what_was_measured_survives_the_cache(tmp_path: Path, looks: Looks) -> None:
    rng = np.random.default_rng(0)
    measured = Looks(
        looks.faces, looks.faces_at, looks.postures, looks.directions,
        rng.random((125, 9)), rng.random((125, 2)), rng.random((125, 2)),
        rng.random(125), rng.random(125),
    )  # fmt: skip
    renderer = Renderer(measured)
    load(tmp_path, renderer, [])
    found = load(tmp_path, renderer, [])
    assert renderer.times == 1
    for name, values in vars(measured).items():
        np.testing.assert_array_equal(getattr(found, name), values)


def test_looks_with_senses_hold_what_was_measured_and_what_is_true(tmp_path: Path) -> None:
    """Ranges are of the surfaces; her head's yaw follows the attended object."""
    count = 12
    found = load_looks(count=count, folder=tmp_path, report=lambda line: None, senses=True)
    assert len(found) == count
    assert np.isfinite(found.face_ranges).all()
    assert np.isfinite(found.object_ranges).mean() > 0.8
    # The surface of her face is near its centre; that of an object is nearer by its radius.
    np.testing.assert_allclose(found.face_ranges[:, 0], found.face_distances, atol=0.06)
    nearer = found.object_distances - found.object_ranges[:, 0]
    assert 0.0 < np.nanmedian(nearer) < 0.06
    assert np.nanmax(np.abs(nearer)) < 0.1
    assert np.corrcoef(found.object_distances, np.nan_to_num(found.object_ranges[:, 0]))[0, 1] > 0
    read = [FaceGaze.from_row(row) for row in found.gazes]
    yaw = np.array([np.nan if gaze is None else gaze.head[0] for gaze in read])
    known = np.isfinite(yaw)
    assert known.mean() > 0.5
    assert np.corrcoef(yaw[known], found.directions[known, 0])[0, 1] > 0.8


def test_a_photo_has_its_own_looks_by_its_content(tmp_path: Path, renderer: Renderer) -> None:
    photo, elsewhere = tmp_path / 'me.npz', tmp_path / 'other' / 'me.npz'
    elsewhere.parent.mkdir()

    def load_with(path: Path | None) -> list[str]:
        lines: list[str] = []
        load_looks(
            count=125,
            folder=tmp_path / 'cache',
            report=lines.append,
            render=renderer,
            photo='' if path is None else str(path),
        )
        return lines

    photo.write_bytes(b'one')
    elsewhere.write_bytes(b'one')
    load_with(None)
    load_with(photo)
    load_with(photo)
    assert renderer.times == 2
    assert load_with(elsewhere) == [], 'the same photograph in another place'
    photo.write_bytes(b'two')
    (line,) = load_with(photo)
    assert 'made with other photo' in line
