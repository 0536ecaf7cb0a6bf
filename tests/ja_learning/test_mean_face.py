"""The mean face: what a look shows beside who she is, and when she is another person."""

import numpy as np
import pytest

from ja_learning.core.contrast_memory import ContrastMemory
from ja_learning.core.mean_face import CONTRAST_SCALE, MeanFaceTracker, contrast, standardised
from ja_learning.core.trial import Look, MeanFace, Trial

ROWS, COLUMNS = np.mgrid[0:30, 0:25]
PLACES = np.zeros((2, 8), np.float32)


def picture(person: int, gaze: float, rng: np.random.Generator | None = None) -> np.ndarray:
    """Draw a person, a pattern of patches, with a dark spot that moves with the gaze (-1 to 1)."""
    patches = np.kron(np.random.default_rng(person).integers(60, 200, (6, 5)), np.ones((5, 5)))
    spot = np.exp(-((ROWS - 15) ** 2 + (COLUMNS - 12 - 8 * gaze) ** 2) / 8)
    noise = 0 if rng is None else rng.normal(0, 3, (30, 25))
    return (patches * (1 - 0.8 * spot) + noise).clip(0, 255).astype(np.uint8)


def watch(
    tracker: MeanFaceTracker, person: int, looks: int, rng: np.random.Generator
) -> list[MeanFace]:
    """Let a tracker see looks of three pictures; return the mean face at the end of each."""
    found = []
    for _ in range(looks):
        gaze = rng.uniform(-1, 1)
        for image in range(3):
            mean_face = tracker.observe(picture(person, gaze, rng), begins_look=image == 0)
        found.append(mean_face)
    return found


def test_the_mean_face_is_that_of_the_looks_before_each_of_the_same_weight():
    tracker = MeanFaceTracker()
    first, second = picture(1, 0.5), picture(1, -0.5)
    for _ in range(9):
        tracker.observe(first, begins_look=False)
    alone = tracker.observe(second, begins_look=True)
    np.testing.assert_allclose(alone.picture, standardised(first), atol=1e-5)
    both = tracker.observe(first, begins_look=True)
    middle = (standardised(first) + standardised(second)) / 2
    np.testing.assert_allclose(both.picture, middle, atol=0.02)
    assert alone.person == both.person


def test_the_first_look_has_the_mean_of_its_own_pictures():
    tracker = MeanFaceTracker()
    tracker.observe(picture(1, 0.5), begins_look=True)
    found = tracker.observe(picture(1, -0.5), begins_look=False)
    middle = (standardised(picture(1, 0.5)) + standardised(picture(1, -0.5))) / 2
    np.testing.assert_allclose(found.picture, middle, atol=1e-5)


@pytest.mark.parametrize('other', [2, 3, 4])
def test_another_person_is_noticed_in_three_looks_and_has_a_mean_face_of_her_own(other: int):
    tracker, rng = MeanFaceTracker(), np.random.default_rng(other)
    before = watch(tracker, 1, 60, rng)[-1]
    numbers = [each.person for each in watch(tracker, other, 10, rng)]
    assert numbers[:3] == [before.person] * 3
    assert len(set(numbers[3:])) == 1
    assert numbers[3] != before.person
    after = watch(tracker, other, 1, rng)[0]
    shown = standardised(np.array([picture(other, gaze) for gaze in np.linspace(-1, 1, 9)]))
    off_new, off_old = (np.abs(shown.mean(axis=0) - m.picture).mean() for m in (after, before))
    assert off_new < 0.3 * off_old


def test_the_same_person_stays_the_same_for_hundreds_of_looks():
    tracker, rng = MeanFaceTracker(), np.random.default_rng(0)
    assert len({each.person for each in watch(tracker, 1, 400, rng)}) == 1


def test_a_single_strange_look_is_no_other_person():
    tracker, rng = MeanFaceTracker(), np.random.default_rng(0)
    person = watch(tracker, 1, 40, rng)[-1].person
    watch(tracker, 2, 2, rng)
    assert watch(tracker, 1, 3, rng)[-1].person == person


def test_a_change_of_exposure_changes_no_contrast():
    dark = (picture(1, 0.3) // 2).astype(np.uint8)
    bright = (dark * 2).astype(np.uint8)
    np.testing.assert_allclose(standardised(dark), standardised(bright), atol=1e-3)
    assert not standardised(np.full((30, 25), 9, np.uint8)).any()


def test_after_a_restart_the_person_is_known_and_new_looks_soon_outweigh_the_old_mean():
    tracker, rng = MeanFaceTracker(), np.random.default_rng(0)
    known = watch(tracker, 1, 50, rng)[-1]
    again = MeanFaceTracker(known)
    first = again.observe(picture(1, 0.9), begins_look=True)
    assert first.person == known.person
    np.testing.assert_allclose(first.picture, known.picture, atol=1e-5)
    other = MeanFaceTracker(known)
    after = watch(other, 2, 60, rng)[-1]
    right = standardised(np.array([picture(2, gaze) for gaze in np.linspace(-1, 1, 9)])).mean(0)
    assert np.abs(after.picture - right).mean() < 0.3 * np.abs(known.picture - right).mean()


def remembered(memory: ContrastMemory, person: int, mean: float, number: int) -> None:
    picture_ = np.full((30, 25), 40, np.uint8)
    picture_[number % 30, 3] = 200
    mean_face = MeanFace(person, np.full((30, 25), mean, np.float32))
    nowhere = np.zeros(2)
    trial = Trial(picture_, nowhere, nowhere[None], None, mean_face=mean_face)
    memory.remember(trial, PLACES)


def test_remembered_faces_are_read_against_the_newest_mean_face_of_their_person():
    memory = ContrastMemory(8)
    for number, (person, mean) in enumerate([(5, 0.1), (5, 0.2), (6, 0.7), (6, 0.9)]):
        remembered(memory, person, mean, number)
    faces, _ = memory.trials_at(np.arange(4))
    means = [
        np.median(standardised_of(age) - face / CONTRAST_SCALE) for age, face in enumerate(faces)
    ]
    np.testing.assert_allclose(means, [0.9, 0.9, 0.2, 0.2], atol=1e-5)


def standardised_of(age: int) -> np.ndarray:
    picture_ = np.full((30, 25), 40, np.uint8)
    picture_[3 - age, 3] = 200
    return standardised(picture_)


@pytest.mark.parametrize('capacity', [3, 100])
def test_a_restored_memory_reads_the_same_and_forgets_persons_of_no_trial(capacity: int):
    memory = ContrastMemory(capacity)
    for number in range(90):
        remembered(memory, number // 10, number / 100, number)
    again = ContrastMemory.restored(memory.state(), capacity)
    ages = np.arange(len(memory))
    np.testing.assert_array_equal(again.trials_at(ages)[0], memory.trials_at(ages)[0])
    assert len(memory.state()['mean_faces']) == (1 if capacity == 3 else 9)
    memory.keep_newest(12)
    assert len(memory.state()['mean_faces']) == min(2, len(memory.state()['persons']))
    remembered(memory, 99, 0.5, 1)
    assert memory.mean_face.person == 99


@pytest.mark.parametrize(
    ('name', 'spoilt'),
    [
        ('person_of_trials', np.array([0, 7])),
        ('person_of_trials', np.array([0])),
        ('mean_faces', np.full((1, 30, 25), np.nan, np.float32)),
        ('persons', np.array([-1])),
    ],
)
def test_another_state_is_refused(name: str, spoilt: np.ndarray):
    memory = ContrastMemory(4)
    for number in range(2):
        remembered(memory, 1, 0.1, number)
    with pytest.raises(ValueError, match=name):
        ContrastMemory.restored(memory.state() | {name: spoilt}, 4)


def test_the_contrast_of_a_look_without_a_mean_face_is_the_picture():
    face = picture(1, 0.2)
    np.testing.assert_array_equal(
        contrast(Look(face, np.zeros(2))), CONTRAST_SCALE * standardised(face)
    )
    mean_face = MeanFace(1, standardised(face))
    assert not contrast(Look(face, np.zeros(2), mean_face=mean_face)).any()
