"""Looks are rendered once and cached, and rendered again when the cache is not valid."""

import json
from pathlib import Path

import numpy as np
import pytest

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
    found = load_looks(count=12, folder=tmp_path, report=lambda line: None)
    again = load_looks(count=12, folder=tmp_path / 'elsewhere', report=lambda line: None)
    np.testing.assert_array_equal(found.faces, again.faces)
    assert found.faces.shape == (12, 30, 25)
    assert len(np.unique(found.directions, axis=0)) == 12
    # The head points at her face, 1.2 m straight ahead.
    assert np.abs(found.postures).max() < np.radians(4)
    assert np.ptp(found.directions[:, 0]) > np.radians(30)
    assert all(face.std() > 10 for face in found.faces)
