"""The simulated environment, and the options for readings of the paper."""

import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_common.core.detection import Kind, objects
from ja_common.core.geometry import angle_between
from ja_common.core.posture import Posture
from ja_control.core.attention_cycle import Phase, Source
from ja_experiments.agents.robot import FixedTurn, Robot
from ja_experiments.config import ExperimentConfig, reading
from ja_experiments.datasets.looks import Looks
from ja_experiments.paper.task import ATTENDED, SimulatedTask
from ja_sim.core.specs import ObjectsSpec


def task_of(config: ExperimentConfig, places: ObjectsSpec, looks: Looks) -> SimulatedTask:
    return SimulatedTask(config.task, config.interest, places, looks)


def test_objects_keep_clear_of_the_face_and_of_each_other(
    places: ObjectsSpec, looks: Looks
) -> None:
    config = ExperimentConfig().with_settings({'objects': 10})
    task, rng = task_of(config, places, looks), np.random.default_rng(0)
    for _ in range(50):
        setting = task.draw_setting(rng)
        np.testing.assert_array_equal(setting.directions[ATTENDED], looks.directions[setting.look])
        to_face = angle_between(setting.directions[1:], looks.postures[setting.look])
        assert to_face.min() > np.radians(places.gap_to_face_deg)
        for index in range(1, 10):
            gaps = angle_between(setting.directions[index], setting.directions[:index])
            assert gaps.min() > np.radians(places.gap_deg)


def test_the_camera_sees_what_is_in_its_view_and_of_interest(
    places: ObjectsSpec, looks: Looks
) -> None:
    task = task_of(ExperimentConfig(), places, looks)
    setting = task.draw_setting(np.random.default_rng(1))
    at_object = setting.directions[ATTENDED]
    seen = task.detections(setting, at_object)
    nearest = min(objects(seen), key=lambda d: np.hypot(*d.ray))
    np.testing.assert_allclose(nearest.ray, 0, atol=1e-12)
    assert nearest.score == pytest.approx(setting.features[ATTENDED, 0])
    assert task.detections(setting, looks.postures[setting.look])[0].kind is Kind.FACE
    blind = task_of(ExperimentConfig().with_settings({'alpha_col': 0.0}), places, looks)
    assert objects(blind.detections(setting, at_object)) == []


def sources_of_trials(drawn: str, trials: int) -> list[set[Source]]:
    """Return the modules that moved the head in each trial, with nothing in view."""
    config = reading('all').with_settings(
        {'gating': 'constant', 'p_lm_max': 0.5, 'source_drawn': drawn}
    )
    robot, found = Robot(config, FixedTurn([0.01, 0.0]), np.random.default_rng(0)), []
    task = SimulatedTask(config.task, config.interest, ObjectsSpec(), one_look())
    setting, stamp_ns = task.draw_setting(np.random.default_rng(0)), 0
    face = [d for d in task.detections(setting, np.zeros(2)) if d.kind is Kind.FACE]
    for _ in range(trials):
        stamp_ns += 10**8
        step = robot.step(face, one_look().faces[0], Posture(stamp_ns, np.zeros(2), np.zeros(2)))
        sources = set()
        while step.decision.phase is Phase.SHIFT:
            sources.add(step.decision.source)
            stamp_ns += 10**8
            step = robot.step([], None, Posture(stamp_ns, step.command, np.zeros(2)))
        found.append(sources)
    return found


def one_look() -> Looks:
    straight = np.zeros((1, 2))
    return Looks(np.zeros((1, 30, 25), np.uint8), straight, straight, np.array([[0.5, 0.0]]))


def test_the_gate_draws_at_every_shift_or_once_a_trial() -> None:
    at_every_shift = sources_of_trials('every_shift', 40)
    once = sources_of_trials('first_shift', 40)
    assert any(len(sources) == 2 for sources in at_every_shift)
    assert all(len(sources) == 1 for sources in once)
    assert len(set.union(*once)) == 2


def test_settings_go_by_the_names_of_parameters() -> None:
    config = ExperimentConfig().with_settings({'hidden': 9, 'still_below_rad_s': 0.1})
    assert config.network.hidden == 9
    assert config.cycle.still_below_rad_s == config.evaluator.still_below_rad_s == 0.1
    assert ExperimentConfig().with_settings(config.settings()) == config
    with pytest.raises(ConfigError, match='hiden is no parameter'):
        config.with_settings({'hiden': 9})
    with pytest.raises(ConfigError, match='objects = 0 is outside'):
        config.with_settings({'objects': 0})
