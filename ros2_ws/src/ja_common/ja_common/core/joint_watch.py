"""Tells which joint of the head stays away from the joint states of a whole robot, and why."""

import difflib
from collections.abc import Collection, Iterable

_SHOWN_NAMES = 12
_KEPT_NAMES = 500


class JointWatch:
    """Knows when each joint was last stated, while messages of any joints come.

    Messages of other joints are normal: arms and wheels use the same topic. Only a joint that
    stays away for longer than `missing_after_s` [s] while messages come is worth a sentence.
    """

    def __init__(self, parameters_by_joint: dict[str, str], missing_after_s: float | None) -> None:
        """`parameters_by_joint`: name of each joint -> parameter that has set the name."""
        self._parameters = parameters_by_joint
        self._missing_after_s = missing_after_s
        self._stated_s: dict[str, float] = {}
        self._why: dict[str, str] = {}
        self._seen: dict[str, None] = {}
        self._coming_since_s = 0.0
        self._received_s: float | None = None

    def record_names(self, names: Iterable[str], now_s: float) -> None:
        """Record which joints a message names; `now_s` is a steady time [s]."""
        # After a pause of the whole topic (`GraphNode` reports it) each joint has its time anew.
        pause_s = None if self._received_s is None else now_s - self._received_s
        if pause_s is None or (self._missing_after_s and pause_s > self._missing_after_s):
            self._coming_since_s = now_s
        self._received_s = now_s
        for name in names:
            if len(self._seen) < _KEPT_NAMES or name in self._parameters:
                self._seen[name] = None

    def record_position(self, joint: str, now_s: float) -> None:
        """Record that a usable position of this joint has come."""
        self._stated_s[joint] = now_s
        self._why.pop(joint, None)

    def record_useless(self, joint: str, why: str) -> None:
        """Record why what a message states of this joint is of no use."""
        self._why[joint] = why

    def explain_missing(self) -> str:
        """Return which joints stay away and what to do, in one sentence; '' while none does."""
        if self._missing_after_s is None or self._received_s is None:
            return ''
        missing = [
            joint
            for joint in self._parameters
            if self._received_s - max(self._stated_s.get(joint, 0.0), self._coming_since_s)
            > self._missing_after_s
        ]
        if not missing:
            return ''
        joints = ' and '.join(repr(joint) for joint in missing)
        text = f'no position of {joints} for more than {self._missing_after_s:g} s, but messages'
        return f'{text} of {self._names()}: {"; ".join(map(self._advice, missing))}'

    def _names(self) -> str:
        names = sorted(self._seen)
        more = f' and {len(names) - _SHOWN_NAMES} more' if len(names) > _SHOWN_NAMES else ''
        return f'{names[:_SHOWN_NAMES]}{more}'

    def _advice(self, joint: str) -> str:
        if joint in self._why:
            return f'{joint!r} comes {self._why[joint]}'
        if joint in self._seen:
            return f'start the driver of {joint!r} again'
        near = nearest_name(joint, self._seen.keys() - self._parameters.keys())
        meant = f', {near!r}?' if near else ' that your rig gives it'
        return f'set {self._parameters[joint]} to the name{meant} (now {joint!r})'


def nearest_name(name: str, names: Collection[str]) -> str:
    """Return the name that is most likely meant, as one with a prefix; '' where none is near."""
    prefixed = sorted(other for other in names if name and name.lower() in other.lower())
    near = prefixed or difflib.get_close_matches(name, sorted(names), 1)
    return near[0] if near else ''
