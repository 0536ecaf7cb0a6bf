"""When the world may go on: as fast as it is answered, at a set pace, or one step at a time."""


class Pace:
    """Whether the next image is due. It knows no time: a clock gives it the `beat`."""

    def __init__(self, lockstep: bool) -> None:
        """In lockstep the next image also waits for the `answer` to the last one."""
        self.paused = False
        self.has_beat = False
        """Does a clock set the pace? Without one an image is due at once."""
        self._lockstep = lockstep
        self._answered = not lockstep
        self._beaten = False
        self._steps = 0

    @property
    def answered(self) -> bool:
        """Is nothing awaited from the robot?"""
        return self._answered

    @property
    def is_due(self) -> bool:
        """May the next image be made now?"""
        if not self._answered:
            return False
        if self.paused:
            return self._steps > 0
        return self._beaten or not self.has_beat

    def answer(self) -> None:
        """The command for the last image has come."""
        self._answered = True

    def beat(self) -> None:
        """The clock's next period has begun."""
        self._beaten = True

    def step(self) -> None:
        """One more image in spite of a pause. Raises ValueError when there is none."""
        if not self.paused:
            raise ValueError('the simulation runs: pause it before a single step')
        self._steps += 1

    def pause(self, paused: bool) -> None:
        """Stand still, or go on; steps that were not taken are forgotten."""
        self.paused, self._steps = paused, 0

    def made(self) -> None:
        """The next image has been made."""
        self._answered = not self._lockstep
        self._beaten = False
        self._steps = max(0, self._steps - 1)
