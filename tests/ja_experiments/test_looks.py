"""Looks are rendered once and kept, and made again when anything about them is not right."""

import json
from pathlib import Path

import numpy as np
import pytest

from ja_experiments.datasets import looks as looks_module
from ja_experiments.datasets.looks import Looks, load_looks


class Renderer:
    """Counts how often looks are made."""

    def __init__(self, looks: Looks) -> None:
        self.looks = looks
        self.times = 0

    def __call__(self, *_: object) -> Looks:
        self.times += 1
        return self.looks


@pytest.fixture
def renderer(looks: Looks, monkeypatch: pytest.MonkeyPatch) -> Renderer:
    renderer = Renderer(looks)
    monkeypatch.setattr(looks_module, '_render', renderer)
    return renderer


def load(folder: Path, said: list[str], seed: int = 0) -> Looks:
    return load_looks(seed=seed, count=125, folder=folder, say=said.append)


def test_looks_are_kept(tmp_path: Path, renderer: Renderer) -> None:
    said: list[str] = []
    first, second = load(tmp_path, said), load(tmp_path, said)
    np.testing.assert_array_equal(first.faces, second.faces)
    np.testing.assert_array_equal(first.directions, second.directions)
    assert renderer.times == 1
    assert len(said) == 1
    assert 'none are kept' in said[0]


def test_another_seed_has_looks_of_its_own(tmp_path: Path, renderer: Renderer) -> None:
    load(tmp_path, [])
    load(tmp_path, [], seed=1)
    load(tmp_path, [])
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
        (other_manifest, 'damaged'),
        (older_sources, 'made by other sources'),
    ],
)
def test_what_cannot_be_used_is_made_again_with_one_line(
    tmp_path: Path, renderer: Renderer, spoil: object, reason: str
) -> None:
    load(tmp_path, [])
    (kept,) = tmp_path.iterdir()
    spoil(kept)  # type: ignore[operator]
    said: list[str] = []
    load(tmp_path, said)
    assert renderer.times == 2
    assert len(said) == 1
    assert reason in said[0]
    load(tmp_path, said)
    assert renderer.times == 2, 'what was made again is kept'


def test_rendered_looks_show_where_she_looks(tmp_path: Path) -> None:
    """Through the real world, detector and crop: her face turns with what she attends to."""
    found = load_looks(count=12, folder=tmp_path, say=lambda line: None)
    again = load_looks(count=12, folder=tmp_path / 'elsewhere', say=lambda line: None)
    np.testing.assert_array_equal(found.faces, again.faces)
    assert found.faces.shape == (12, 30, 25)
    assert len(np.unique(found.directions, axis=0)) == 12
    # The head stands on her face, 1.2 m straight ahead.
    assert np.abs(found.postures).max() < np.radians(4)
    assert np.ptp(found.directions[:, 0]) > np.radians(30)
    assert all(face.std() > 10 for face in found.faces)
