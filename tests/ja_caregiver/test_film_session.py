"""A film that goes on only while the head looks at her."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import pytest

from ja_caregiver.core.film_clips import Clip
from ja_caregiver.core.film_session import FilmSession, FilmSessionConfig, SessionPhase
from ja_caregiver.core.schedule import ScheduledLook

FACE = np.array([0.1, 0.05])
AWAY = np.array([0.6, 0.1])


def clips(count: int, pictures: int = 10) -> Iterator[Clip]:
    """Clip k has pictures of grey level 20 k, 20 k + 1, ...; the first 4 are of the camera."""
    for number in range(count):
        levels = 20 * number + np.arange(pictures)
        shown = tuple(np.full((2, 2, 3), level, np.uint8) for level in levels)
        yield Clip(ScheduledLook(0, 1, 2, number % 3 + 1), shown, 4)


def make(count: int = 3, **config: float) -> FilmSession:
    return FilmSession(partial(next, clips(count), None), 10.0, FilmSessionConfig(**config))


def step(session: FilmSession, posture=FACE, still=True, face=FACE) -> int:
    """Show one picture to a head with this posture; return its grey level."""
    level = int(session.next_picture()[0, 0, 0])
    session.observe(np.asarray(posture), still, None if face is None else np.asarray(face))
    return level


def test_before_the_head_looks_at_her_she_looks_at_the_camera():
    session = make()
    levels = [step(session, AWAY, face=None) for _ in range(8)]
    assert levels == [0, 1, 2, 3, 2, 1, 0, 1]
    assert (session.trial, session.phase) == (0, SessionPhase.CAMERA)


@pytest.mark.parametrize(
    ('posture', 'still', 'face'), [(FACE, False, FACE), (AWAY, True, FACE), (FACE, True, None)]
)
def test_a_head_that_moves_looks_elsewhere_or_sees_no_face_starts_nothing(posture, still, face):
    session = make()
    for _ in range(5):
        step(session, posture, still, face)
    assert session.trial == 0


def test_a_look_is_played_to_its_end_and_then_held_to_and_fro():
    session = make(held_s=0.3, patience_s=5.0)
    step(session)
    levels = [step(session) for _ in range(18)]
    assert levels[:10] == list(range(10))
    assert levels[10:] == [9, 8, 7, 8, 9, 8, 7, 8]
    assert (session.trial, session.phase, session.asked) == (1, SessionPhase.HELD, True)


def test_she_is_asked_after_the_pictures_of_the_camera():
    session = make()
    step(session)
    found = []
    for _ in range(6):
        session.next_picture()
        found.append(session.asked)
        session.observe(FACE, True, FACE)
    assert found == [False] * 4 + [True] * 2


def test_while_the_head_is_away_the_end_is_held_and_the_next_look_follows_its_return():
    session = make(held_s=0.2)
    step(session)
    for _ in range(10):
        step(session)
    away = [step(session, AWAY, face=None) for _ in range(7)]
    assert set(away) == {8, 9}
    step(session)
    assert [step(session) for _ in range(3)] == [20, 21, 22]
    assert session.trial == 2
    assert session.clip.look.thing == 2


def test_a_head_that_leaves_early_sees_no_more_of_the_look():
    session = make(held_s=0.2)
    step(session)
    for _ in range(5):
        step(session)
    levels = [step(session, AWAY, face=None) for _ in range(6)]
    assert max(levels) <= 6
    assert session.phase is SessionPhase.HELD


def test_a_head_that_stays_has_the_next_look_after_a_while():
    session = make(patience_s=1.0)
    for _ in range(24):
        step(session)
    assert session.trial == 2


def test_a_head_that_moves_a_little_has_not_left():
    session = make(patience_s=100.0)
    for _ in range(30):
        step(session, FACE + np.array([0.06, 0.0]))
    assert session.trial == 1


def test_a_head_that_lost_her_sees_her_look_at_the_camera_again():
    session = make(lost_s=1.0)
    for _ in range(11):
        step(session)
    for _ in range(20):
        level = step(session, AWAY, face=None)
    assert 20 <= level < 24
    assert (session.phase, session.trial) == (SessionPhase.CAMERA, 1)
    step(session)
    assert session.trial == 2


def test_without_any_face_the_session_still_ends():
    session = make(count=2, lost_s=1.0, given_up_s=2.0)
    for _ in range(200):
        step(session, AWAY, face=None)
        if session.phase is SessionPhase.ENDED:
            break
    assert (session.phase, session.trial) == (SessionPhase.ENDED, 3)


def test_after_the_last_look_it_has_ended_and_shows_its_end():
    session = make(count=1, held_s=0.2)
    step(session)
    for _ in range(10):
        step(session)
    step(session, AWAY, face=None)
    step(session)
    assert (session.phase, session.trial) == (SessionPhase.ENDED, 2)
    assert {step(session) for _ in range(4)} == {8, 9}


def test_a_film_without_a_look_is_refused():
    with pytest.raises(ValueError, match='ends before its first look'):
        make(count=0)
