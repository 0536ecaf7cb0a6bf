"""The score of a learner alone on stills."""

from pathlib import Path

import pytest

from ja_benchmarks.stills import score_stills
from ja_common.core.config import ConfigError
from still_pictures import write_stills


@pytest.fixture(scope='module')
def folder(tmp_path_factory) -> Path:
    """Make a folder of stills."""
    folder = tmp_path_factory.mktemp('stills')
    write_stills(folder)
    return folder


def test_the_learner_alone_learns_from_stills(folder: Path):
    lines: list[str] = []
    (curve,) = score_stills(folder, report=lines.append).values()
    assert curve[100] > 0.5, 'chance is 0.2'
    assert 'chance 0.20' in lines[-1]


def test_too_few_stills_of_a_person_are_no_score(folder: Path, tmp_path: Path):
    for path in sorted(folder.iterdir())[:3]:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    with pytest.raises(ConfigError, match='no person has 10 stills'):
        score_stills(tmp_path, report=lambda _: None)
