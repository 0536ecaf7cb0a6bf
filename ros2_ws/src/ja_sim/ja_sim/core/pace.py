"""When the next image is due: when the last is answered, at a set rate, or one step at a time."""


class Pace:
    """Whether the next image is due. It measures no time: a timer calls `record_period`."""

    def __init__(self, lockstep: bool) -> None:
        """Set up; in lockstep the next image also waits for the command for the last one."""
        self.paused = False
        self.has_timer = False
        """Does a timer set the rate? Without one an image is due at once."""
        self._lockstep = lockstep
        self._answered = not lockstep
        self._period_elapsed = False
        self._steps = 0

    @property
    def answered(self) -> bool:
        """Return whether no command is awaited from the robot."""
        return self._answered

    @property
    def is_due(self) -> bool:
        """Return whether the next image may be made now."""
        if not self._answered:
            return False
        if self.paused:
            return self._steps > 0
        return self._period_elapsed or not self.has_timer

    def record_answer(self) -> None:
        """Record that the command for the last image has come."""
        self._answered = True

    def record_period(self) -> None:
        """Record that the timer's next period has begun."""
        self._period_elapsed = True

    def request_step(self) -> None:
        """Request one more image in spite of a pause. Raises ValueError when there is none."""
        if not self.paused:
            raise ValueError('the simulation runs: pause it before a single step')
        self._steps += 1

    def set_paused(self, paused: bool) -> None:
        """Pause, or continue; steps that were requested and not taken are dropped."""
        self.paused, self._steps = paused, 0

    def record_image(self) -> None:
        """Record that the next image has been made."""
        self._answered = not self._lockstep
        self._period_elapsed = False
        self._steps = max(0, self._steps - 1)
