"""The learner of a node: it learns in a thread of its own, and is saved in checkpoints."""

import math
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.clock import Clock, ClockType
from std_msgs.msg import String
from std_srvs.srv import Trigger

from ja_common.core.background_save import RETRY_S
from ja_common.core.detection import Detection
from ja_common.core.health import Level
from ja_common.core.weight_files import note_weight_files
from ja_common.graph_node import GraphNode
from ja_common.realtime import use_default_scheduling
from ja_common.topics import TRACK, WEIGHT_FILES
from ja_common.weight_files_codec import decode_weight_files
from ja_learning.core.background_learner import BackgroundLearner
from ja_learning.core.checkpoint_folder import CheckpointConfig, CheckpointFolder, Resumed
from ja_learning.core.learner import KnowsAPerson, Learner, Predictor
from ja_learning.core.track import Origin, Track, TrackConfig
from ja_learning.core.trial import Trial

MANY_WAITING = 10
"""When more trials than this wait to be learned, learning cannot keep up."""

BEHIND_IN_LOCKSTEP = 1
"""Learning a trial may take as long as the next trial lasts, on another processor."""

CLOSING_S = 1.0
"""So long may learning go on when the node ends [s]; then the last checkpoint is written."""


class PersistentLearner:
    """A learner that continues from the newest good checkpoint, and is saved as it learns.

    Offers the services `save_checkpoint` and `load_checkpoint`, and reports to the node's health.
    """

    def __init__(self, node: GraphNode, make: Callable[[], Learner], lockstep: bool) -> None:
        """Make the learner, and advertise its services.

        `make` makes an untrained learner. `lockstep`: what is believed depends on no clock.
        Raises ConfigError or OSError when the checkpoints cannot be used.
        """
        self._node = node
        self._make = make
        self._origin = Origin(node.configure(TrackConfig))
        self._track_publisher = node.create_topic_publisher(TRACK)
        self._published_track: Track | None = None
        self._behind = BEHIND_IN_LOCKSTEP if lockstep else None
        self._checkpoints = self._open(node.configure(CheckpointConfig))
        learner = self._made()
        self._config = learner.config
        if self._checkpoints is not None and self._checkpoints.config.resume:
            self._resume(learner)
        self.mean_face = learner.mean_face if isinstance(learner, KnowsAPerson) else None
        """Of the person of whom was learned before the start, if any is kept."""
        self._background = self._in_background(learner)
        self._unsaved = ''  # why the last save failed, until one succeeds
        self._was_unsaved = False
        self._retry: Future[None] | None = None
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(RETRY_S, self._report_save, clock=steady)
        self.report_health()
        node.advertise_service(Trigger, 'save_checkpoint', self._on_save)
        node.advertise_service(Trigger, 'load_checkpoint', self._on_load)
        node.subscribe(WEIGHT_FILES, self._on_weight_files)
        self._publish_track()

    @property
    def predictor(self) -> Predictor:
        """Return what is believed now; in lockstep, what was believed a trial ago."""
        return self._background.predictor

    @property
    def track(self) -> Track:
        """Return what the learner has started from, and whether it has used ranges."""
        return self._origin.track(self._config)

    def allowed(self, detections: list[Detection]) -> list[Detection]:
        """Return the detections with the ranges that the learner may use (`use_ranges`)."""
        allowed = self._origin.allowed(detections)
        self._publish_track()
        return allowed

    def update(self, trial: Trial) -> None:
        """Hand over a finished trial; return at once."""
        self._background.update(trial)

    def reset(self) -> None:
        """Forget everything, in the newest checkpoint too; `load_checkpoint` can go back."""
        forgotten = self._replace(self._made())
        if self._checkpoints is not None:
            self._try(self._checkpoints.save_when_changed, forgotten)
        self._origin.reset()
        self._publish_track()
        if self._checkpoints is None:
            return
        self._background.call_with_learner(self._save_reset)
        if self._unsaved:
            text = f'a restart would bring back what was forgotten: {self._unsaved}'
            self._node.report_problem('reset', text)

    def report_health(self) -> None:
        """Put the progress of learning, and its errors, into the node's health."""
        waiting = self._background.waiting
        self._node.health.values['trials learned'] = str(self._background.trials)
        self._node.health.values['of these still waiting'] = str(waiting)
        for error in self._background.pop_errors():
            self._node.report_problem('learning', f'learning: {error}')
        if waiting > MANY_WAITING:
            text = f'more than {MANY_WAITING} trials wait to be learned: replay less after each'
            self._node.report_problem('waiting', text, Level.WARN)

    def close(self) -> None:
        """Learn and save the trials handed over, and end."""
        learner = self._background.close(CLOSING_S)
        if learner.trials < self._background.trials:
            lost = self._background.trials - learner.trials
            self._node.report_problem('learning', f'{lost} trials were not learned before the end')
        if self._checkpoints is None:
            return
        # After a failure also an equal count of trials may be of another learner.
        save = self._checkpoints.save if self._unsaved else self._checkpoints.save_when_changed
        self._try(save, learner)
        if self._unsaved:
            text = f'the trials since the last checkpoint are lost: {self._unsaved}'
            self._node.report_problem('lost trials', text)
        self._checkpoints.close()

    def _open(self, config: CheckpointConfig) -> CheckpointFolder | None:
        if not config.checkpoint_folder:
            return None
        folder = self._node.namespaced_folder(config.checkpoint_folder)
        return CheckpointFolder(folder, config, self._origin)

    def _made(self) -> Learner:
        """Make an untrained learner, and note the weight files that it opens."""
        with note_weight_files() as files:
            learner = self._make()
        self._origin.set_code_files(files)
        return learner

    def _in_background(self, learner: Learner) -> BackgroundLearner:
        # An update is not urgent, even where answers are (`realtime_priority`).
        return BackgroundLearner(learner, self._after_update, self._behind, use_default_scheduling)

    def _replace(self, learner: Learner) -> Learner:
        """Continue with another learner; return the one before."""
        before = self._background.close(0.0)
        self._config = learner.config
        self._background = self._in_background(learner)
        return before

    def _after_update(self, learner: Learner) -> None:
        """Run in the thread that learns."""
        if math.isfinite(learner.last_error_rad):  # the fast learner has none
            self._node.health.values['last error [rad]'] = f'{learner.last_error_rad:.3f}'
        # A save that failed is tried again by the clock, not after every trial.
        if self._checkpoints is not None and not self._unsaved:
            self._try(self._checkpoints.save_when_due, learner)

    def _save(self, learner: Learner) -> None:
        self._try(self._kept_in().save, learner)

    def _save_reset(self, learner: Learner) -> None:
        self._try(self._kept_in().save_reset, learner)

    def _try(self, save: Callable[[Learner], object], learner: Learner) -> None:
        """Save, or keep why that failed; run in the thread that learns while there is one."""
        try:
            save(learner)
        except (ValueError, OSError) as error:
            self._unsaved = str(error)
        else:
            self._unsaved = ''

    def _report_save(self) -> None:
        """Report a save that failed, and try it again, until one succeeds."""
        if self._unsaved:
            self._node.report_problem('saving', self._unsaved)
            if self._retry is None or self._retry.done():
                self._retry = self._background.call_later(self._save)
        elif self._was_unsaved:
            self._node.health.clear_problem('saving')
            self._node.get_logger().info('checkpoints are saved again')
        self._was_unsaved = bool(self._unsaved)

    def _kept_in(self) -> CheckpointFolder:
        if self._checkpoints is None:
            raise ValueError('the parameter checkpoint_folder is empty: no place for checkpoints')
        return self._checkpoints

    def _resume(self, learner: Learner) -> Path | None:
        return self._report_resumed(learner, self._kept_in().resume_into(learner))

    def _report_resumed(self, learner: Learner, resumed: Resumed) -> Path | None:
        path, refused = resumed
        for text in refused:
            self._node.report_problem('checkpoints', f'refused: {text}', Level.WARN)
        if path is not None:
            self._node.get_logger().info(f'goes on from {path}, {learner.trials} trials')
            self._report_weight_files(self._origin.changed_weight_files())
        return path

    def _publish_track(self) -> None:
        """Publish the track when it has changed; late subscribers get the last one."""
        track = self.track
        if track != self._published_track:
            self._published_track = track
            self._track_publisher.publish(String(data=str(track)))

    def _on_weight_files(self, message: DiagnosticStatus) -> None:
        self._report_weight_files(self._origin.set_weight_files(decode_weight_files(message)))

    def _report_weight_files(self, changes: str) -> None:
        if changes:
            text = f'what was learned is of other weight files of the eyes: {changes}'
            self._node.report_problem('weight files', text, Level.WARN)

    def _on_save(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        path = self._background.call_with_learner(self._kept_in().save)
        response.message = f'{self._background.trials} trials saved to {path}'
        response.success = True
        return response

    def _on_load(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        learner = self._made()
        path = self._report_resumed(learner, self._kept_in().go_back(learner))
        if path is None:
            raise ValueError(f'no checkpoint in {self._kept_in().folder}')
        self._replace(learner)
        self._publish_track()
        response.message = f'{self._background.trials} trials loaded from {path}'
        response.success = True
        return response
