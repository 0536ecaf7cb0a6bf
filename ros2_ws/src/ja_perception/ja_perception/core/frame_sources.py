"""What every source of pictures has in common: its interface, its options, its errors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from numpy.typing import NDArray

STILL_HZ = 15.0
"""Pictures a second of a source that states no rate of its own."""

Warn = Callable[[str, str], None]
"""Reports what is wrong with a source that runs on: (part of the source, one sentence)."""


class SourceError(ValueError):
    """A source without pictures; the text names it, the reason and what to do."""


class NotYetError(Exception):
    """A live source has no new picture yet."""


@dataclass(frozen=True)
class SourceOptions:
    """How a source is played.

    ``rate_hz`` (0: the source's own) and ``highest_rate_hz`` in pictures a second; ``still_s`` is
    the time for which a picture of a folder is shown.
    """

    loop: bool = True
    rate_hz: float = 0.0
    highest_rate_hz: float = 120.0
    still_s: float = 5.0


class FrameSource(Protocol):
    """An endless or ending stream of (H, W, 3) uint8 RGB pictures."""

    @property
    def summary(self) -> str:
        """Return one sentence on what is played, and what is left out."""
        ...

    @property
    def period_s(self) -> float:
        """Return the time from the picture returned last to the next one [s]."""
        ...

    def next_frame(self) -> NDArray | None:
        """Return the next picture; None at the end.

        Raises ``SourceError`` when there is none now, ``NotYetError`` when none is due.
        """
        ...

    def close(self) -> None:
        """Release the device or file."""
        ...
