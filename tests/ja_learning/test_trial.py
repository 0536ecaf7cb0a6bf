"""A trial, cut out of looks, rests and fixations that no message announces."""

import numpy as np
import pytest

from ja_learning.core.trial import FACE_SHAPE, Look, TrialRecorder

FACE = np.full(FACE_SHAPE, 100, np.uint8)
OTHER_FACE = np.full(FACE_SHAPE, 200, np.uint8)
HER_FACE = (0.01, -0.02)
CAREGIVER, FIRST, SECOND = (0.0, 0.0), (0.2, 0.1), (0.5, 0.2)
BALL = (0.55, 0.25)


@pytest.fixture
def recorder():
    return TrialRecorder(same_within_rad=0.02)


def test_trial_has_the_posture_where_each_shift_began(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    recorder.observe_rest(FIRST)
    recorder.observe_rest(SECOND)
    trial = recorder.observe_fixation(SECOND, BALL)
    assert trial.face is FACE
    assert trial.face_at == pytest.approx(HER_FACE)
    assert trial.postures == pytest.approx(np.array([CAREGIVER, FIRST])), 'no shift began at last'
    assert trial.fixation == pytest.approx(BALL)
    assert trial.displacements() == pytest.approx(np.array([(0.55, 0.25), (0.35, 0.15)]))


def test_fixation_may_come_before_or_after_the_rest_of_its_image(recorder):
    """Two topics carry them, in no fixed order."""
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    before = recorder.observe_fixation(FIRST, BALL)
    recorder.observe_rest(FIRST)
    assert recorder.look is None
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    recorder.observe_rest(FIRST)
    after = recorder.observe_fixation(FIRST, BALL)
    assert np.array_equal(before.postures, after.postures)
    assert before.postures == pytest.approx(np.array([CAREGIVER]))


def test_repeated_postures_count_once(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    for jitter in (0.0, 0.01, -0.01, 0.005):
        recorder.observe_rest((FIRST[0] + jitter, FIRST[1]))
    assert len(recorder.observe_fixation(SECOND, BALL).postures) == 2


def test_trial_begins_with_the_last_image_of_the_look(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), (0.1, 0.0))
    recorder.observe_look(Look(OTHER_FACE, HER_FACE), CAREGIVER)
    trial = recorder.observe_fixation(FIRST, BALL)
    assert trial.face is OTHER_FACE
    assert trial.postures == pytest.approx(np.array([CAREGIVER]))


def test_look_without_fixation_leaves_nothing(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    recorder.observe_rest(FIRST)
    recorder.observe_look(Look(OTHER_FACE, HER_FACE), CAREGIVER)
    assert len(recorder.observe_fixation(SECOND, BALL).postures) == 1


def test_only_the_first_fixation_ends_a_trial(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    assert recorder.observe_fixation(FIRST, BALL) is not None
    assert recorder.observe_fixation(FIRST, BALL) is None
    recorder.observe_rest(SECOND)
    assert recorder.observe_fixation(SECOND, BALL) is None


def test_fixation_without_a_look_is_no_trial(recorder):
    recorder.observe_rest(FIRST)
    assert recorder.observe_fixation(FIRST, BALL) is None


def test_what_stands_before_the_face_during_the_look_ends_no_trial(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    assert recorder.observe_fixation(CAREGIVER, (0.03, 0.0)) is None
    assert recorder.observe_fixation(FIRST, BALL) is not None, 'the trial went on'


def test_forgotten_trial_is_over(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    recorder.drop_trial()
    assert recorder.observe_fixation(FIRST, BALL) is None


@pytest.mark.parametrize('face', [np.zeros((25, 30), np.uint8), np.zeros(FACE_SHAPE)])
def test_picture_that_is_no_face_is_refused(recorder, face):
    with pytest.raises(ValueError, match='30 rows x 25 columns'):
        recorder.observe_look(Look(face, HER_FACE), CAREGIVER)


def test_a_trial_knows_what_was_seen_before_the_head_acted_on_the_face(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    recorder.record_candidates([(0.3, 0.0)])
    recorder.observe_rest(FIRST)
    recorder.record_candidates([(0.3, 0.0), (-0.4, 0.1)])
    recorder.observe_shift()
    recorder.record_candidates([BALL])
    trial = recorder.observe_fixation(SECOND, BALL)
    assert trial.seen_before_shift == 2
    assert trial.candidates == pytest.approx(np.array([(0.3, 0.0), (-0.4, 0.1), BALL]))
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    assert recorder.observe_fixation(SECOND, BALL).seen_before_shift == 0


def test_a_trial_without_a_fixation_is_given_up_with_the_next_look(recorder):
    assert recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER) is None
    assert recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER) is None, 'the same look goes on'
    recorder.record_candidates([(0.3, 0.0)])
    recorder.observe_rest(FIRST)
    recorder.record_candidates([(-0.4, 0.1)])
    given_up = recorder.observe_look(Look(OTHER_FACE, HER_FACE), CAREGIVER)
    assert given_up.face is FACE
    assert given_up.fixation is None
    assert given_up.candidates == pytest.approx(np.array([(0.3, 0.0), (-0.4, 0.1)]))
    with pytest.raises(ValueError, match='given up'):
        given_up.displacements()
    assert recorder.look.face is OTHER_FACE
    assert len(recorder.candidates) == 0


def test_a_trial_that_ended_in_a_fixation_is_not_given_up(recorder):
    recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER)
    recorder.observe_rest(FIRST)
    recorder.observe_fixation(FIRST, BALL)
    assert recorder.observe_look(Look(FACE, HER_FACE), CAREGIVER) is None
