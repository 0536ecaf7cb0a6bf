"""Which thing is asked for next: drawn by the scorer alone, balanced, and never predictable."""

from collections import Counter
from collections.abc import Collection

import numpy as np

# A number of its own beside the seed: the robot's generators start from the seed alone.
_STREAM = 0xCA2E
# A thing that was asked for once more than another is drawn half as often.
_BALANCE = 0.5


class RequestDraw:
    """Draws among the things that are there. Each may always come next, the last one too."""

    def __init__(self, seed: int, trials_done: int = 0) -> None:
        """Start with a generator of its own: from the same seed the same sequence.

        `trials_done`: of a meeting that goes on, which must not repeat its sequence.
        """
        self._random = np.random.default_rng([seed, _STREAM, trials_done])
        self._asked: Counter[int] = Counter()

    def restart(self) -> None:
        """Forget how often each was asked for: the numbers stand for other things now."""
        self._asked.clear()

    def draw(self, numbers: Collection[int]) -> int:
        """Draw one of the numbers. Raises ValueError when there is none."""
        if not numbers:
            raise ValueError('there is no thing to ask for')
        ordered = sorted(numbers)
        least = min((self._asked[each] for each in ordered if each in self._asked), default=0)
        for each in ordered:
            # A thing that appears late need not catch up: it would be predictable.
            self._asked.setdefault(each, least)
        weights = np.array([_BALANCE ** (self._asked[number] - least) for number in ordered])
        number = int(self._random.choice(ordered, p=weights / weights.sum()))
        self._asked[number] += 1
        return number
