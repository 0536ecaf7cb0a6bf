"""The benchmark of face codes reads no caregiver with a code that knows her."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ja_benchmarks.benchmarks import face_codes
from ja_experiments.datasets.looks import Looks
from ja_learning.core.face_code import OTHERS
from ja_learning.core.learner_registry import make_learner
from ja_sim.core.caregiver import identities


def test_the_two_halves_are_all_people_and_share_none():
    first, second = (face_codes._people(half) for half in range(2))
    assert sorted(first + second) == sorted(identities())
    assert not set(first) & set(second)


@pytest.mark.parametrize('seed', [10, 13])
def test_the_code_of_others_is_of_people_without_the_caregiver(
    seed: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    random = np.random.default_rng(seed)
    looks = Looks(
        random.integers(0, 256, (4, 30, 25), dtype=np.uint8),
        np.zeros((4, 2)),
        np.zeros((4, 2)),
        random.uniform([0.3, -0.1], [0.5, 0.1], (4, 2)),
    )
    used: list[str] = []

    def make(kind: str, learner_seed: int, config: Any) -> Any:
        used.append(config.face_code)
        return make_learner('paper', learner_seed)

    monkeypatch.setattr(face_codes, '_looks', lambda seed: looks)
    monkeypatch.setattr(face_codes, 'make_learner', make)
    monkeypatch.setattr(face_codes, 'MARKS', (1, 2))
    monkeypatch.setattr(face_codes, 'TEST_LOOKS', 2)
    shares = face_codes.curve(OTHERS, tmp_path, seed)
    assert len(shares) == 2
    assert all(0 <= share <= 1 for share in shares)
    (half,) = [half for half in range(2) if used == [str(face_codes._code_file(tmp_path, half))]]
    assert face_codes._person(seed) not in face_codes._people(half)
    assert face_codes._person(seed) in face_codes._people(1 - half)
