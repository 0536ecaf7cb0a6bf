"""The tasks of the benchmark: so many objects, and what changes under way."""

from __future__ import annotations

from dataclasses import dataclass

from ja_common.core.config import ConfigError

SCENE, OTHER_SCENE = 'default', 'bare_room'
CHANGES = ('none', 'caregiver', 'room', 'mirror')


@dataclass(frozen=True)
class ScoredTask:
    """A task: `objects` in each trial, and the numbers of trials after which learners are tested.

    `marks`: numbers of trials, from 0 on. `reliability`: share of the looks in practice at which
    the caregiver attends to an object. `change`: after the last of the marks she is another
    `caregiver`, sits in another `room`, or her face is seen as in a `mirror`. Then a second stage
    begins. `marks_after`: numbers of trials after the change.
    """

    name: str
    objects: int
    marks: tuple[int, ...]
    reliability: float = 1.0
    change: str = 'none'
    marks_after: tuple[int, ...] = ()

    @property
    def stages(self) -> tuple[tuple[int, ...], ...]:
        """Return the marks of each stage, counted from the beginning of the stage."""
        return (self.marks, self.marks_after) if self.marks_after else (self.marks,)

    @property
    def environment(self) -> str:
        """Return the id of the task in Gymnasium."""
        words = ''.join(word.capitalize() for word in self.name.split('-'))
        return f'JointAttention/{words}-v0'


_BEFORE, _AFTER = (0, 100), (0, 10, 25, 50)
TASKS = {
    task.name: task
    for task in (
        ScoredTask('five-objects', 5, (0, 5, 10, 15, 25, 50, 100, 200)),
        ScoredTask('ten-objects', 10, (0, 25, 50, 100, 200, 300)),
        ScoredTask('unreliable-caregiver', 5, (0, 25, 50, 100, 200), reliability=0.7),
        ScoredTask('new-caregiver', 5, _BEFORE, change='caregiver', marks_after=_AFTER),
        ScoredTask('new-room', 5, _BEFORE, change='room', marks_after=_AFTER),
        ScoredTask('mirrored-camera', 5, _BEFORE, change='mirror', marks_after=_AFTER),
    )
}
PRACTICE_LOOKS = max(mark for task in TASKS.values() for mark in task.marks)
"""Looks in practice before anything changes; more trials repeat them, among other objects."""
PRACTICE_LOOKS_AFTER = max(_AFTER)


def find_task(name: str) -> ScoredTask:
    """Return the task of this name. Raises ConfigError when there is none."""
    if name not in TASKS:
        raise ConfigError(f'{name!r:.50} is not a task: choose one of {", ".join(TASKS)}')
    return TASKS[name]
