"""The learner of a node: it learns beside the images, and what it learned outlives the node."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from std_srvs.srv import Trigger

from ja_common.core.health import Level
from ja_common.graph_node import GraphNode
from ja_common.realtime import use_default_scheduling
from ja_learning.core.background_learner import BackgroundLearner
from ja_learning.core.checkpoint_folder import CheckpointConfig, CheckpointFolder
from ja_learning.core.learner import Learner, Predictor
from ja_learning.core.trial import Trial

MANY_WAITING = 10
"""So many trials that wait to be learned mean that learning cannot keep up."""

BEHIND_IN_LOCKSTEP = 1
"""Learning a trial may take as long as living the next one, on another processor."""

CLOSING_S = 1.0
"""So long may learning go on when the node is asked to end [s]; then comes the last checkpoint."""


class PersistentLearner:
    """Goes on from the newest good checkpoint, saves itself as it goes, and when it is closed.

    Offers the services `save_checkpoint` and `load_checkpoint`, and reports to the node's health.
    """

    def __init__(self, node: GraphNode, make: Callable[[], Learner], lockstep: bool) -> None:
        """`make` gives an untrained learner. `lockstep`: what is believed depends on no clock.

        Raises ConfigError or OSError when the checkpoints cannot be used.
        """
        self._node = node
        self._make = make
        self._behind = BEHIND_IN_LOCKSTEP if lockstep else None
        self._checkpoints = self._open(node.configure(CheckpointConfig))
        learner = make()
        if self._checkpoints is not None and self._checkpoints.config.resume:
            self._resume(learner)
        self._lessons = self._at_work(learner)
        self.tell()
        node.advertise_service(Trigger, 'save_checkpoint', self._on_save)
        node.advertise_service(Trigger, 'load_checkpoint', self._on_load)

    @property
    def predictor(self) -> Predictor:
        """What is believed now; in lockstep, what was believed a trial ago."""
        return self._lessons.predictor

    def learn(self, trial: Trial) -> None:
        """Hand over a finished trial; returns at once."""
        self._lessons.learn(trial)

    def begin_anew(self) -> None:
        """Forget everything; a restart will not bring it back."""
        self._replace(self._make())
        if self._checkpoints is None:
            return
        try:
            self._lessons.ask(self._checkpoints.save)
        except (ValueError, OSError) as error:
            text = f'a restart would bring back what was forgotten: {error}'
            self._node.problem('checkpoints', text)

    def tell(self) -> None:
        """Put into the node's health how far learning is, and what went wrong with it."""
        waiting = self._lessons.waiting
        self._node.health.values['trials learned'] = str(self._lessons.trials)
        self._node.health.values['of these still waiting'] = str(waiting)
        for error in self._lessons.pop_errors():
            self._node.problem('learning', f'learning: {error}')
        if waiting > MANY_WAITING:
            text = f'more than {MANY_WAITING} trials wait to be learned: replay less after each'
            self._node.problem('waiting', text, Level.WARN)

    def close(self) -> None:
        """Learn and save what has been lived, and end."""
        learner = self._lessons.close(CLOSING_S)
        if learner.trials < self._lessons.trials:
            lost = self._lessons.trials - learner.trials
            self._node.problem('learning', f'{lost} trials were not learned before the end')
        if self._checkpoints is None:
            return
        try:
            self._checkpoints.save_when_changed(learner)
        except (ValueError, OSError) as error:
            self._node.problem('checkpoints', f'the last trials are lost: {error}')
        self._checkpoints.close()

    def _open(self, config: CheckpointConfig) -> CheckpointFolder | None:
        if not config.checkpoint_folder:
            return None
        return CheckpointFolder(self._node.folder_of_its_own(config.checkpoint_folder), config)

    def _at_work(self, learner: Learner) -> BackgroundLearner:
        # A lesson is not urgent, even where answers are (`realtime_priority`).
        return BackgroundLearner(learner, self._after_lesson, self._behind, use_default_scheduling)

    def _replace(self, learner: Learner) -> None:
        self._lessons.close(0.0)
        self._lessons = self._at_work(learner)

    def _after_lesson(self, learner: Learner) -> None:
        """In the thread of the lessons."""
        self._node.health.values['last error [rad]'] = f'{learner.last_error_rad:.3f}'
        if self._checkpoints is not None:
            self._checkpoints.save_when_due(learner)

    def _kept_in(self) -> CheckpointFolder:
        if self._checkpoints is None:
            raise ValueError('the parameter checkpoint_folder is empty: no place for checkpoints')
        return self._checkpoints

    def _resume(self, learner: Learner) -> Path | None:
        path, refused = self._kept_in().resume_into(learner)
        for text in refused:
            self._node.problem('checkpoints', f'refused: {text}', Level.WARN)
        if path is not None:
            self._node.get_logger().info(f'goes on from {path}, {learner.trials} trials')
        return path

    def _on_save(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        path = self._lessons.ask(self._kept_in().save)
        response.message = f'{self._lessons.trials} trials saved to {path}'
        response.success = True
        return response

    def _on_load(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        learner = self._make()
        path = self._resume(learner)
        if path is None:
            raise ValueError(f'no checkpoint in {self._kept_in().folder}')
        self._replace(learner)
        response.message = f'{self._lessons.trials} trials loaded from {path}'
        response.success = True
        return response
