"""What a learner needs to enter the benchmark, and how it is found.

    class MyLearner:
        track = 'strict'                       # what it uses; stands in every row

        def __init__(self, seed): ...
        def propose(self, observation): ...    # a change of posture (2,) [rad]
        def learn(self, observation, fixated): ...  # after each trial of practice

In practice the robot turns to the most salient object; `fixated` is its index. So every entrant
practises on the same trials. One that chooses its actions itself has, in place of `learn`,

        def practise(self, env, trials): ...   # `env`: a `TrialEnv`

and the environment counts its trials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol, runtime_checkable

import gymnasium
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_experiments.learning_tasks.drawn_trials import Observation
from ja_learning.core.track import Start, Track

REWARDED, PRETRAINED = 'rewarded', 'pretrained'


class FrozenEntrant(Protocol):
    """A learner in the benchmark, made with its seed as the only argument, as a test sees it.

    Tests ask a deep copy. `track`: what it uses, a text of `EntryTrack`. `trials_scale`, if it has
    one: it practises for so many times more trials than the task states, and its rows state how
    many.
    """

    track: str

    def propose(self, observation: Observation) -> NDArray:
        """Return a change of posture (2,) [rad] towards the object that she attends to."""


@runtime_checkable
class LearningEntrant(FrozenEntrant, Protocol):
    """An entrant that learns from the trials of the most salient object."""

    def learn(self, observation: Observation, fixated: int) -> None:
        """Learn from one trial of practice, which ended with a fixation of this object."""


@runtime_checkable
class ActingEntrant(FrozenEntrant, Protocol):
    """An entrant that chooses its actions in practice."""

    def practise(self, env: gymnasium.Env, trials: int) -> None:
        """Act in a `TrialEnv` for exactly so many trials."""


Entrant = LearningEntrant | ActingEntrant


@dataclass(frozen=True)
class EntryTrack:
    """The track of an entrant: its senses, and what it declares beside them.

    As text: a track of `ja_learning.core.track` alone, or behind one of the words `rewarded` (it
    learns from the reward) and `pretrained` (it starts from weights that it did not learn here),
    where `strict` is left out: `rewarded`, `pretrained with depth`, `rewarded landmarks`.
    """

    senses: Track
    declared: str = ''

    def __str__(self) -> str:
        if not self.declared:
            return str(self.senses)
        return f'{self.declared} {self.senses}'.replace(f' {Start.STRICT.value}', '')

    @staticmethod
    def parse(text: str) -> EntryTrack:
        """Return the track of a text. Raises ConfigError when it is none."""
        first, _, rest = text.partition(' ')
        declared = first if first in (REWARDED, PRETRAINED) else ''
        senses = rest if declared else text
        if declared and (not senses or senses.startswith('with ')):
            senses = f'{Start.STRICT.value} {senses}'.strip()
        try:
            return EntryTrack(Track.parse(senses), declared)
        except ValueError as error:
            words = f'{REWARDED} or {PRETRAINED}'
            raise ConfigError(f'{error}; each may stand behind {words}') from None


def load_entrant(name: str) -> Callable[[int], Entrant]:
    """Return what makes an entrant from a seed, by `MODULE:CLASS`.

    Raises ConfigError when there is no such class, or it cannot enter.
    """
    module, _, attribute = name.partition(':')
    try:
        made: Any = getattr(import_module(module), attribute)
    except ModuleNotFoundError as error:
        raise ConfigError(
            f'{name}: {error}; its folder must be in PYTHONPATH, as in PYTHONPATH=. ./ja ...'
        ) from None
    except (AttributeError, ValueError):
        raise ConfigError(f'{name}: there is no such class; write MODULE:CLASS') from None
    missing = [each for each in ('track', 'propose') if not hasattr(made, each)]
    if not (hasattr(made, 'learn') or hasattr(made, 'practise')):
        missing.append('learn')
    if missing:
        raise ConfigError(f'{name} has no {", no ".join(missing)}')
    EntryTrack.parse(made.track)
    return made
