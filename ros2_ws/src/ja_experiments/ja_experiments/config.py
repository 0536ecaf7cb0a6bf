"""The configuration of one experiment: the nodes' own, and what the simulated task adds."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_control.core.attention_cycle import AttentionCycleConfig
from ja_control.core.gating import GatingConfig
from ja_control.core.joint_limits import JointLimitsConfig
from ja_control.core.visual_feedback import VisualFeedbackConfig
from ja_learning.core.evaluator import EvaluatorConfig
from ja_learning.core.look_around import LookAroundConfig
from ja_learning.core.network_config import NetworkConfig
from ja_perception.core.salient_objects import InterestConfig

IMAGE_PERIOD_S = 0.1
"""Time between two images of the simulated trials: the ideal head has then arrived."""


@dataclass(frozen=True)
class TaskConfig(Configuration):
    """The simulated environment of section 3.1.

    Objects are placed within the ranges of the scene in which the looks were rendered.
    """

    objects: int = parameter(
        5, 'objects in the environment, the attended one included', low=1, high=100
    )
    reliability: float = parameter(
        1.0, 'share of the trials in which the caregiver looks at the attended object',
        low=0.0, high=1.0,
    )  # fmt: skip
    shakes_object: bool = parameter(False, 'the caregiver moves the attended object')
    view_pan_rad: float = parameter(
        math.radians(18), 'half of the horizontal field of view [rad]', low=0.01, high=1.5
    )
    view_tilt_rad: float = parameter(
        math.radians(13.5), 'half of the vertical field of view [rad]', low=0.01, high=1.5
    )
    taught: str = parameter(
        'fixation', 'end of a trial as the learner learns it: direction of the fixated object, '
        'or posture reached by the executed commands', choices=('fixation', 'executed'),
    )  # fmt: skip


@dataclass(frozen=True)
class ExperimentConfig:
    """All parameters of one run, besides the looks and the seed."""

    task: TaskConfig = field(default_factory=TaskConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    gating: GatingConfig = field(default_factory=GatingConfig)
    cycle: AttentionCycleConfig = field(
        # The ideal head points at the face when the trial begins, and has reached its target when
        # the next image comes.
        default_factory=lambda: AttentionCycleConfig(
            dwell_s=0.0, settle_timeout_s=IMAGE_PERIOD_S / 2
        )
    )
    look_around: LookAroundConfig = field(default_factory=LookAroundConfig)
    evaluator: EvaluatorConfig = field(default_factory=EvaluatorConfig)
    visual_feedback: VisualFeedbackConfig = field(default_factory=VisualFeedbackConfig)
    interest: InterestConfig = field(default_factory=InterestConfig)
    limits: JointLimitsConfig = field(default_factory=JointLimitsConfig)

    def with_settings(self, settings: dict[str, Any]) -> ExperimentConfig:
        """Return a copy with some parameters changed, each by its name as in a node's file.

        Raises ConfigError for an unknown name or an invalid value.
        """
        parts = {part.name: getattr(self, part.name) for part in dataclasses.fields(self)}
        for name, value in settings.items():
            owners = [key for key, part in parts.items() if name in _parameters(part)]
            if not owners:
                raise ConfigError(f'{name} is no parameter of the experiment')
            for key in owners:
                parts[key] = dataclasses.replace(parts[key], **{name: value})
        return ExperimentConfig(**parts)

    def settings(self) -> dict[str, Any]:
        """Return every parameter by its name, as `with_settings` takes them."""
        parts = [getattr(self, part.name) for part in dataclasses.fields(self)]
        return {name: getattr(part, name) for part in parts for name in _parameters(part)}


def _parameters(part: Any) -> dict[str, dataclasses.Field]:
    return {item.name: item for item in dataclasses.fields(part)}


READINGS = {
    'all': {'pairs': 'all', 'max_shifts': 5},
    'last': {'pairs': 'last', 'max_shifts': 10},
}
"""The two readings of the paper: one trial gives a pair for all postures visited, or the last."""

VALUES: dict[str, dict[str, dict[str, Any]]] = {
    'first': {
        'all': {'learning_rate': 0.003, 'sigmoid_slope_trials': 3e4},
        'last': {'learning_rate': 0.01, 'sigmoid_slope_trials': 1.5e4},
    },
    'chosen': {
        'all': {'learning_rate': 0.003, 'initial_weight': 0.2, 'sigmoid_slope_trials': 3e4},
        'last': {
            'learning_rate': 0.01, 'angle_scale_rad': 0.35, 'sigmoid_slope_trials': 1.5e4,
        },
    },
}  # fmt: skip
"""The numbers that the paper does not give, by reading: the first that worked, and those that a
sweep chose by the rule of `paper/choice.py`."""


def reading(name: str, values: str = 'first') -> ExperimentConfig:
    """Return the configuration of one of the `READINGS`, with one set of the `VALUES`."""
    return ExperimentConfig().with_settings(READINGS[name] | VALUES[values][name])
