"""Learning beside inference: one thread learns, a snapshot of the weights answers meanwhile."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import TypeVar

from ja_learning.core.learner import Learner, Predictor
from ja_learning.core.trial import Trial

Answer = TypeVar('Answer')


class BackgroundLearner:
    """Owns a learner, which nobody else may touch but through `ask`.

    A lesson shows in what `predictor` answers all at once, when it is over. When that is depends
    on what else the machine has to do. Who needs the same answers in every run sets `behind`: the
    newest so many lessons never show yet, and all those before them are waited for.
    """

    def __init__(
        self,
        learner: Learner,
        learned: Callable[[Learner], None],
        behind: int | None = None,
        begins: Callable[[], None] = lambda: None,
    ) -> None:
        """In the thread that learns `begins` is called first, `learned` after every lesson."""
        self._learner = learner
        self._learned = learned
        self._behind = behind
        self._thread = ThreadPoolExecutor(1, thread_name_prefix='learner', initializer=begins)
        self._lessons: deque[Future[Predictor]] = deque()
        self._predictor: Predictor = learner.snapshot()
        self._errors: deque[Exception] = deque()
        self.trials = learner.trials
        """Trials handed over, those that are still to be learned included."""

    @property
    def predictor(self) -> Predictor:
        """What is believed now."""
        while self._lessons and self._may_show():
            self._predictor = self._lessons.popleft().result()
        return self._predictor

    @property
    def waiting(self) -> int:
        """How many lessons are still to be learned, the one under way included."""
        return sum(not lesson.done() for lesson in self._lessons)

    def learn(self, trial: Trial) -> None:
        """Hand over a finished trial; returns at once."""
        self.trials += 1
        self._lessons.append(self._thread.submit(self._learn, trial))

    def pop_errors(self) -> list[Exception]:
        """What went wrong in lessons since the last call, in `learned` too."""
        return [self._errors.popleft() for _ in range(len(self._errors))]

    def ask(self, question: Callable[[Learner], Answer]) -> Answer:
        """The answer of the learner itself when all is learned; waits for it.

        What the question raises is raised here.
        """
        return self._thread.submit(question, self._learner).result()

    def close(self, patience_s: float) -> Learner:
        """Learn what was handed over, if it takes no longer [s], and give the learner back."""
        try:
            wait(self._lessons, timeout=patience_s)
        finally:  # a second Ctrl-C: without this the thread would still learn all that waits
            self._thread.shutdown(cancel_futures=True)
        return self._learner

    def _may_show(self) -> bool:
        if self._behind is None:
            return self._lessons[0].done()
        return len(self._lessons) > self._behind

    def _learn(self, trial: Trial) -> Predictor:
        try:
            self._learner.learn(trial)
            self._learned(self._learner)
        except Exception as error:  # it belongs to who asks for pop_errors
            self._errors.append(error)
        return self._learner.snapshot()
