"""Learning beside inference: one thread learns, and a snapshot answers questions meanwhile."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import TypeVar

from ja_learning.core.learner import Learner, Predictor
from ja_learning.core.trial import Trial

Answer = TypeVar('Answer')


class BackgroundLearner:
    """A learner in a thread of its own; others reach it only through `call_with_learner`.

    An update shows in the answers of `predictor` all at once, when it is over. When that is
    depends on what else the machine has to do. For the same answers in every run, set `behind`:
    the newest so many updates do not show yet, and all those before them are waited for.
    """

    def __init__(
        self,
        learner: Learner,
        after_update: Callable[[Learner], None],
        behind: int | None = None,
        on_start: Callable[[], None] = lambda: None,
    ) -> None:
        """Start the thread that learns.

        It calls `on_start` first, and `after_update` after every update.
        """
        self._learner = learner
        self._after_update = after_update
        self._behind = behind
        self._thread = ThreadPoolExecutor(1, thread_name_prefix='learner', initializer=on_start)
        self._pending_updates: deque[Future[Predictor]] = deque()
        self._predictor: Predictor = learner.snapshot()
        self._errors: deque[Exception] = deque()
        self.trials = learner.trials
        """Trials handed over, those that are still to be learned included."""

    @property
    def predictor(self) -> Predictor:
        """Return what is believed now."""
        while self._pending_updates and self._may_show():
            self._predictor = self._pending_updates.popleft().result()
        return self._predictor

    @property
    def waiting(self) -> int:
        """Return how many updates are not over, the one under way included."""
        return sum(not update.done() for update in self._pending_updates)

    def update(self, trial: Trial) -> None:
        """Hand over a finished trial; return at once."""
        self.trials += 1
        self._pending_updates.append(self._thread.submit(self._update, trial))

    def pop_errors(self) -> list[Exception]:
        """Return the errors of updates, and of `after_update`, since the last call."""
        return [self._errors.popleft() for _ in range(len(self._errors))]

    def call_later(self, function: Callable[[Learner], None]) -> Future[None]:
        """Call a function with the learner after all pending updates; return at once."""
        return self._thread.submit(function, self._learner)

    def call_with_learner(self, function: Callable[[Learner], Answer]) -> Answer:
        """Wait for all pending updates, call a function with the learner, and return its answer.

        Raises what the function raises.
        """
        return self._thread.submit(function, self._learner).result()

    def close(self, patience_s: float) -> Learner:
        """Learn the pending trials for at most so long [s], and give the learner back."""
        try:
            wait(self._pending_updates, timeout=patience_s)
        finally:  # a second Ctrl-C: without this the thread would still learn all that waits
            self._thread.shutdown(cancel_futures=True)
        return self._learner

    def _may_show(self) -> bool:
        if self._behind is None:
            return self._pending_updates[0].done()
        return len(self._pending_updates) > self._behind

    def _update(self, trial: Trial) -> Predictor:
        try:
            self._learner.update(trial)
            self._after_update(self._learner)
        except Exception as error:  # kept for the caller of pop_errors
            self._errors.append(error)
        return self._learner.snapshot()
