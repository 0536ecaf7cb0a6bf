"""Evidence from shuffled faces: none by chance, much from knowledge, and it falls again."""

import numpy as np
import pytest

from ja_learning.core.evidence import ChangeAlarm, Evidence
from ja_learning.core.trial import FACE_SHAPE


def face_of(number: int) -> np.ndarray:
    return np.full(FACE_SHAPE, number, np.uint8)


def weighed(evidence: Evidence, trials: int, log_p, seed: int = 0) -> list[float]:
    """Return the evidence after each trial; `log_p(rng, n)`: log p of what n faces explain."""
    rng = np.random.default_rng(seed)
    history = []
    for trial in range(trials):
        evidence.weigh_trial(face_of(trial % 256), lambda faces: log_p(rng, len(faces))[None])
        history.append(float(evidence.nats[0]))
    return history


def by_chance(rng: np.random.Generator, faces: int) -> np.ndarray:
    return rng.normal(0, 2, faces)


def knowing(rng: np.random.Generator, faces: int) -> np.ndarray:
    return rng.normal(0, 1, faces) + np.eye(faces)[0] * 2


def test_chance_rarely_passes_for_knowledge():
    """Ville: the evidence is beyond 20 with a probability of 1 / 20 at most, however long."""
    passed = [max(weighed(Evidence(), 300, by_chance, s)) > np.log(20) for s in range(200)]
    assert np.mean(passed) < 0.05


def test_knowledge_shows_and_falls_again_when_the_world_has_changed():
    evidence = Evidence()
    assert weighed(evidence, 60, knowing)[-1] > 20
    wrong = weighed(evidence, 60, lambda rng, n: -knowing(rng, n))
    assert wrong[-1] < 0


def test_nothing_is_weighed_before_there_are_other_faces():
    assert weighed(Evidence(), 15, knowing) == [0.0] * 15


def test_one_trial_without_an_attended_object_costs_little():
    evidence = Evidence()
    before = weighed(evidence, 40, knowing)[-1]
    evidence.weigh_trial(face_of(0), lambda faces: np.array([[-1e6] + [0.0] * (len(faces) - 1)]))
    assert before - evidence.nats[0] < 3


def test_beliefs_are_weighed_side_by_side():
    evidence = Evidence(beliefs=2)
    rng = np.random.default_rng(0)
    for trial in range(60):
        evidence.weigh_trial(
            face_of(trial), lambda f: np.array([knowing(rng, len(f)), by_chance(rng, len(f))])
        )
    assert evidence.nats[0] > 20 > 5 > evidence.nats[1]


def test_restored_evidence_goes_on_as_before():
    one, other = Evidence(), Evidence()
    weighed(one, 30, knowing)
    other.restore(one.state())
    assert weighed(one, 5, knowing, 1) == weighed(other, 5, knowing, 1)
    with pytest.raises(ValueError, match='must hold numbers'):
        other.restore(one.state() | {'evidence.nats': np.array([np.nan])})


def test_a_change_is_noticed_soon_and_no_bad_luck_is_taken_for_one():
    rng = np.random.default_rng(0)

    def trials_to_alarm(log_ratios):
        alarm = ChangeAlarm()
        for trial, ratio in enumerate(log_ratios, 1):
            if alarm.add_log_ratio(ratio, knew=True):
                return trial, alarm.doubtful_trials
        return None, alarm.doubtful_trials

    # A caregiver who is elsewhere in three trials of ten says little, and never enough.
    elsewhere = rng.random(2000) < 0.3
    assert trials_to_alarm(np.where(elsewhere, -1.3, 1.1))[0] is None
    before, after = np.full(100, 1.0), np.full(60, -1.7)
    noticed, since = trials_to_alarm(np.concatenate([before, after]))
    assert 100 < noticed <= 120
    assert since == noticed - 100, 'it knows when the change was'


def test_a_learner_that_never_knew_anything_raises_no_alarm():
    alarm = ChangeAlarm()
    assert not any(alarm.add_log_ratio(-2.0, knew=False) for _ in range(100))
