"""Learning beside inference: one thread learns, a snapshot of the weights answers meanwhile."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from ja_learning.core.learner import Learner, Predictor
from ja_learning.core.trial import Trial

Result = TypeVar('Result')


class BackgroundLearner:
    """Owns a learner, which nobody else may touch but through `do`.

    What is asked of `predictor` is answered by the newest snapshot: a lesson shows in it at the
    end of its update, all at once. Who needs the same answers in every run calls `settle` first.
    """

    def __init__(self, learner: Learner, learned: Callable[[Learner], None]) -> None:
        """`learned` is called after every lesson, in the thread that learns."""
        self._learner = learner
        self._learned = learned
        self._thread = ThreadPoolExecutor(1, thread_name_prefix='learner')
        self._lessons: deque[Future[None]] = deque()
        self.predictor: Predictor = learner.snapshot()
        self.trials = learner.trials
        """Trials handed over, those that are still to be learned included."""

    @property
    def waiting(self) -> int:
        """How many lessons are still to be learned, the one under way included."""
        return sum(not lesson.done() for lesson in self._lessons)

    def learn(self, trial: Trial) -> None:
        """Hand over a finished trial; returns at once."""
        self.trials += 1
        self._lessons.append(self._thread.submit(self._learn, trial))

    def settle(self) -> None:
        """Wait until all that was handed over is learned."""
        for lesson in self._lessons:
            lesson.exception()

    def troubles(self) -> list[Exception]:
        """What went wrong in lessons since the last call (in `learned` too); waits for nothing."""
        ended = []
        while self._lessons and self._lessons[0].done():
            ended.append(self._lessons.popleft().exception())
        return [error for error in ended if isinstance(error, Exception)]

    def do(self, action: Callable[[Learner], Result]) -> Result:
        """Let something be done with the learner when all is learned, and wait for the result.

        What the action raises is raised here.
        """

        def act() -> Result:
            result = action(self._learner)
            self.predictor = self._learner.snapshot()
            return result

        result = self._thread.submit(act).result()
        self.trials = self._learner.trials
        return result

    def close(self) -> Learner:
        """Learn what was handed over, end the thread, and give the learner back."""
        self._thread.shutdown()
        return self._learner

    def _learn(self, trial: Trial) -> None:
        self._learner.learn(trial)
        self.predictor = self._learner.snapshot()
        self._learned(self._learner)
