"""A course: exams of the learner alone before and after practice, so that learning shows.

In an exam every gaze shift follows the learner (p(LM) = 1) and nothing is learned; in practice the
gate and the learner work as they were configured. The course only sets public parameters and calls
public services, as any node may.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from rcl_interfaces.msg import ParameterValue
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool

from ja_runner.progress import ProgressNode

_GATING = ('gating', 'p_lm_max')
_LEARNER_ALWAYS = ('constant', 1.0)
# The course ends even if the graph no longer answers.
_SWITCH_WITHIN_S = 10.0


@dataclass(frozen=True)
class Stage:
    """A part of a course: a number of trials, and a time limit [s]."""

    name: str
    trials: int
    time_s: float
    learner_alone: bool


def standard_course(trials: int, time_s: float, exam_trials: int) -> list[Stage]:
    """Return exam, practice, exam; only practice when `exam_trials` is 0."""
    practice = Stage('practice', trials, time_s, learner_alone=False)
    if not exam_trials:
        return [practice]
    return [
        Stage('exam before', exam_trials // 2, 20.0, learner_alone=True),
        practice,
        Stage('exam after', exam_trials, 30.0, learner_alone=True),
    ]


class _State(Enum):
    ASKING = 'asking how the gate is configured'
    SWITCHING = 'switching to the next stage'
    RUNNING = 'counting trials'
    DONE = 'done'


class Course:
    """Leads a running graph through the stages; call `tick` after every spin."""

    def __init__(self, node: ProgressNode, stages: Sequence[Stage]) -> None:
        self._node = node
        self._stages = list(stages)
        self._gate = AsyncParameterClient(node, 'gate')
        self._learning = node.create_client(SetBool, 'learning_enabled')
        self._state = _State.ASKING
        self._configured: tuple[Any, ...] = ()
        self._responses: list[Any] = []
        self._first_trial = 0
        self._began_s = 0.0
        node.curve.stage = ''

    def tick(self) -> bool:
        """Advance the course; return True when it is over."""
        if self._state is _State.ASKING:
            self._ask()
        elif self._state is _State.SWITCHING:
            self._wait_for_the_switch()
        elif self._state is _State.RUNNING and self._stage_is_over():
            self._stages.pop(0)
            self._switch()
        return self._state is _State.DONE

    def _ask(self) -> None:
        if not self._responses:
            if self._gate.services_are_ready() and self._learning.service_is_ready():
                self._responses = [self._gate.get_parameters(list(_GATING))]
        elif self._responses[0].done():
            values: list[ParameterValue] = self._responses[0].result().values
            self._configured = tuple(parameter_value_to_python(value) for value in values)
            self._switch()

    def _switch(self) -> None:
        if not self._stages:
            self._state = _State.DONE
            return
        alone = self._stages[0].learner_alone
        gating = _LEARNER_ALWAYS if alone else self._configured
        parameters = [
            Parameter(name, value=value) for name, value in zip(_GATING, gating, strict=True)
        ]
        self._responses = [
            self._gate.set_parameters(parameters),
            self._learning.call_async(SetBool.Request(data=not alone)),
        ]
        self._node.curve.stage = ''
        self._began_s = self._node.elapsed_s
        self._state = _State.SWITCHING

    def _wait_for_the_switch(self) -> None:
        curve = self._node.curve
        late = self._node.elapsed_s - self._began_s > _SWITCH_WITHIN_S
        if not (late or all(response.done() for response in self._responses)):
            self._first_trial = len(curve.records) + 1  # the trial under way belongs to neither
        elif late or len(curve.records) >= self._first_trial:
            self._first_trial = len(curve.records)
            self._began_s = self._node.elapsed_s
            curve.stage = self._stages[0].name
            self._state = _State.RUNNING

    def _stage_is_over(self) -> bool:
        stage = self._stages[0]
        return (
            len(self._node.curve.records) - self._first_trial >= stage.trials
            or self._node.elapsed_s - self._began_s >= stage.time_s
        )
