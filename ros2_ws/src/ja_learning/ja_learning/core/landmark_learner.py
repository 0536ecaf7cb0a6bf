"""A fast learner from landmarks: which of all objects that were seen does her gaze point at?

The same question, and the same candidates without labels, as in `gaze_line`. But head pose and
eyes come from foreign weights, so that what is left to learn - what they mean for where she looks
- has few parameters, and its whole posterior is known (`gaze_posterior`).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_learning.core.checkpoint_arrays import count, numbers
from ja_learning.core.evidence import ChangeAlarm, Evidence
from ja_learning.core.gaze_line_belief import AnswersFromSnapshot, GazeLineBelief
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.gaze_line_places import seen_places
from ja_learning.core.gaze_posterior import GazePosterior
from ja_learning.core.gaze_table import level_mixture
from ja_learning.core.landmark_features import PRIOR, READING, landmark_features, read_landmarks
from ja_learning.core.replay_memory import ReplayMemory
from ja_learning.core.seen_trials import TrialTables
from ja_learning.core.trial import FACE_SHAPE, Look, Trial

# Older trials are forgotten: a slow change of the world is followed.
_REMEMBERED = 600
# A proposal mixes so many of the maps.
_ASKED = 64
_CLEAR_NATS = 10.0
# What the random numbers of a trial are for.
_PRIOR, _MOVES, _SAMPLES, _CHANGE = range(4)


class LandmarkLearner(AnswersFromSnapshot):
    """The posterior over maps from landmarks to gazes, trial by trial."""

    kind = 'gaze_line'

    def __init__(self, config: GazeLineConfig, seed: int) -> None:
        """Draw the maps from the prior with this seed, and compile what learns and answers."""
        self.config = config
        self._seed = seed
        self.trials = 0
        self._posterior = GazePosterior(PRIOR, self._random(_PRIOR))
        self._memory = ReplayMemory(_REMEMBERED, READING)
        self._tables = self._tabulate(self._memory, 0)
        self._evidence = Evidence(faces=READING)
        self._alarm = ChangeAlarm()
        self._belief: GazeLineBelief | None = None
        self.last_error_rad = float('nan')
        self.propose(Look(np.zeros(FACE_SHAPE, np.uint8), np.zeros(2)), np.zeros(2), [])

    @property
    def log_evidence(self) -> float:
        """Return the evidence [nats] that the face informs this learner, as in `Predictor`."""
        return float(self._evidence.nats[0])

    def snapshot(self) -> GazeLineBelief:
        """Return what is believed now, made when first asked for; no later update changes it."""
        if self._belief is None:
            maps = self._posterior.sample(self._random(_SAMPLES), _ASKED)
            self._belief = GazeLineBelief(
                read_landmarks,
                lambda readings: maps.gazes(landmark_features(readings)),
                level_mixture(maps.levels),
                np.full(len(maps.levels), -np.log(len(maps.levels))),
                self.log_evidence,
                self.config.top_down,
                self.config.plausible_within_nats,
            )
        return self._belief

    def update(self, trial: Trial) -> None:
        """Weigh the maps by a trial; resample and move them where few carry the weight."""
        self.trials += 1
        look = trial.look
        reading = read_landmarks(look)
        if reading is None or not len(trial.candidates):
            return
        self._belief = None
        places = seen_places(look, trial.candidates, trial.ranges)
        changed = False
        if trial.seen_before_shift:
            changed = self._weigh(reading, places[: trial.seen_before_shift])
        self._memory.remember_trial(reading, places)
        self._tables.add_newest()
        if changed:
            self._forget_before_change()
        else:
            self._posterior.weigh(self._tables.newest())
        self._posterior.move_where_needed(self._tables.all(), self._random(_MOVES))

    def _random(self, purpose: int) -> np.random.Generator:
        """Return the random numbers of this trial: the same after a restart."""
        return np.random.default_rng([self._seed, self.trials, purpose])

    def _weigh(self, reading: NDArray[np.float32], places: NDArray[np.float64]) -> bool:
        """Weigh what was seen; return whether it is clear by now that the world has changed."""
        if not len(self._tables):
            return False  # the first trial: there is nothing to compare it with

        def log_probability(readings: NDArray[Any]) -> NDArray[np.float64]:
            return self._posterior.log_ratios(self._tables.seen(readings, places))[None]

        knew = self.log_evidence > _CLEAR_NATS
        log_ratio = float(self._evidence.weigh_trial(reading, log_probability)[-1])
        return self._alarm.add_log_ratio(log_ratio, knew)

    def _forget_before_change(self) -> None:
        """Keep only the trials since the change, and draw half of the maps anew."""
        self._memory.keep_newest(self._alarm.doubtful_trials)
        self._tables = self._tabulate(self._memory, len(self._memory))
        self._alarm.reset()
        self._evidence.nats[:] = 0.0
        self._posterior.doubt_half(self._tables.all(), self._random(_CHANGE))

    @staticmethod
    def _tabulate(memory: ReplayMemory, trials: int) -> TrialTables:
        return TrialTables(memory, landmark_features, _REMEMBERED, trials)

    def state(self) -> dict[str, NDArray[Any]]:
        """Return all that learning has changed, the remembered trials too, as named arrays."""
        arrays: dict[str, NDArray[Any]] = {
            'trials': np.array(self.trials),
            'seed': np.array(self._seed),
            'doubt': np.array(self._alarm.doubt),
            'doubtful_trials': np.array(self._alarm.doubtful_trials),
            'tabled_trials': np.array(self._tables.trials),
        }
        return arrays | self._posterior.state() | self._memory.state() | self._evidence.state()

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take the state of `state()`.

        Raises ValueError, and changes nothing, if it is not one of this learner.
        """
        posterior = GazePosterior(PRIOR, self._random(_PRIOR))
        posterior.restore(arrays)
        memory = ReplayMemory.restored(arrays, _REMEMBERED, READING)
        evidence = Evidence(faces=READING)
        evidence.restore(arrays)
        trials, seed = count(arrays, 'trials'), count(arrays, 'seed')
        doubt = float(numbers(arrays, 'doubt', (), np.float64, low=0.0))
        doubtful, tabled = count(arrays, 'doubtful_trials'), count(arrays, 'tabled_trials')
        if tabled < len(memory):
            raise ValueError(f'tabled_trials must be at least {len(memory)}')
        self._posterior, self._memory, self._evidence = posterior, memory, evidence
        self._tables = self._tabulate(memory, tabled)
        self.trials, self._seed, self._belief = trials, seed, None
        self._alarm.doubt, self._alarm.doubtful_trials = doubt, doubtful
