"""The trials of a film: cut by the look that is shown, answered by the first fixation."""

from dataclasses import replace

import numpy as np
import pytest

from ja_caregiver.core.film_score import FilmImage, FilmScore
from ja_caregiver.core.film_session import SessionPhase
from ja_common.core.request_phase import RequestPhase

THINGS = {1: (0.4, 0.1), 2: (-0.3, 0.1)}
FACE, ONE, TWO = np.array([0.0, 0.0]), np.array(THINGS[1]), np.array(THINGS[2])
ASIDE = np.array([0.5, 0.0])


class Robot:
    """Gives images one after the other to a score."""

    def __init__(self, trials: int = 3) -> None:
        self.score = FilmScore(trials, 0.1)
        self.image = FilmImage(0, 0, SessionPhase.CAMERA, False, 1, THINGS, {}, FACE)

    def show(self, **changes):
        self.image = replace(self.image, stamp_ns=self.image.stamp_ns + 10**8, **changes)
        return self.score.observe_image(self.image)

    def look(self, trial: int, thing: int):
        """Look at her while she looks at a thing; return the trial that this ends."""
        targets = {'face': FACE}
        ended = self.show(
            trial=trial, thing=thing, phase=SessionPhase.LOOK, asked=False,
            targets=targets, command=FACE, fixation=None,
        )  # fmt: skip
        self.show(asked=True)
        return ended

    def shift(self, to: np.ndarray, learner: np.ndarray | None, visual: np.ndarray | None):
        targets = {'face': FACE, 'learner': learner, 'visual feedback': visual}
        known = {name: value for name, value in targets.items() if value is not None}
        self.show(targets=known, command=to, phase=SessionPhase.HELD)


@pytest.fixture
def robot() -> Robot:
    return Robot()


def test_a_shift_of_the_learner_and_a_fixation_make_a_trial(robot):
    robot.look(1, 1)
    robot.shift(ONE, learner=ONE, visual=TWO)
    shifted_ns = robot.image.stamp_ns
    robot.show(fixation=ONE + 0.02)
    trial = robot.look(2, 2)
    assert (trial.trial, trial.asked, trial.proposed, trial.fixated) == (1, 1, 1, 1)
    assert (trial.success, trial.learner_right, trial.followed_learner) == (True, True, True)
    assert (trial.stamp_ns, trial.things) == (shifted_ns, THINGS)


def test_a_shift_of_visual_feedback_is_not_the_learner(robot):
    robot.look(1, 1)
    robot.shift(TWO, learner=ONE, visual=TWO)
    robot.show(fixation=TWO)
    trial = robot.look(2, 2)
    assert (trial.proposed, trial.fixated, trial.followed_learner) == (1, 2, False)


def test_a_glance_is_no_shift(robot):
    robot.look(1, 1)
    robot.show(targets={'face': FACE, 'glance': ASIDE, 'learner': TWO}, command=ASIDE)
    assert not robot.score.shift_began
    robot.shift(ONE, learner=ONE, visual=None)
    assert robot.score.shift_began
    robot.show(fixation=ONE)
    assert robot.look(2, 2).proposed == 1


def test_the_first_shift_counts_for_the_learner_and_the_first_fixation_for_the_head(robot):
    robot.look(1, 1)
    robot.shift(TWO, learner=TWO, visual=None)
    robot.shift(ONE, learner=ONE, visual=None)
    robot.show(fixation=ONE)
    robot.show(fixation=TWO)
    trial = robot.look(2, 2)
    assert (trial.proposed, trial.fixated) == (2, 1)


def test_what_stands_in_the_centre_before_the_shift_is_no_answer(robot):
    robot.look(1, 1)
    robot.show(fixation=ONE)
    assert robot.look(2, 2).fixated is None


def test_a_fixation_far_from_all_things_is_of_none(robot):
    robot.look(1, 1)
    robot.shift(ASIDE, learner=None, visual=ASIDE)
    robot.show(fixation=np.array([-0.6, -0.2]))
    trial = robot.look(2, 2)
    assert (trial.proposed, trial.fixated, trial.learner_right) == (None, None, None)


def test_a_trial_that_was_given_up_has_no_fixation(robot):
    robot.look(1, 1)
    robot.shift(ASIDE, learner=ASIDE, visual=None)
    robot.show(command=FACE, targets={'face': FACE})
    trial = robot.look(2, 2)
    assert (trial.fixated, trial.followed_learner) == (None, True)


def test_the_end_of_the_film_ends_the_last_trial_and_starts_none(robot):
    robot.look(1, 1)
    trial = robot.show(trial=2, phase=SessionPhase.ENDED)
    assert trial.trial == 1
    assert robot.score.phase is RequestPhase.ENDED
    assert robot.show() is None


def test_the_page_sees_the_course(robot):
    score, seen = robot.score, []

    def note():
        seen.append((score.phase, score.asked, score.trials_done, score.message))

    robot.show()
    note()
    robot.look(1, 2)
    note()
    robot.shift(ONE, learner=ONE, visual=None)
    robot.show(fixation=ONE)
    note()
    robot.look(2, 1)
    note()
    assert seen == [
        (RequestPhase.STARTING, None, 0, 'The film starts when the head looks at her.'),
        (RequestPhase.THING, 2, 0, 'She looks at thing 2.'),
        (RequestPhase.ANSWER, 2, 1, 'The head looks at thing 1: wrong.'),
        (RequestPhase.THING, 1, 1, 'She looks at thing 1.'),
    ]
    assert score.last is not None
    assert score.last.trial == 1


def test_a_pause_shows_and_ends(robot):
    robot.look(1, 1)
    robot.score.pause(True)
    robot.score.pause(True)
    assert robot.score.phase is RequestPhase.PAUSED
    robot.score.pause(False)
    assert robot.score.phase is RequestPhase.THING
    robot.score.pause(False)
    assert robot.score.phase is RequestPhase.THING
