"""The checkpoints of a learner: numbered files, of which a start takes the newest good one."""

import fcntl
import os
import re
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any, NamedTuple

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.files import why_not_written
from ja_learning.core.checkpoint import load_checkpoint, save_checkpoint
from ja_learning.core.learner import Learner
from ja_learning.core.track import Origin

LAST = 'last.npz'
"""Link to the checkpoint that was written last, for people and tools; nothing here reads it."""

_NAME = re.compile(r'(?P<kind>\w+)-(?P<number>\d{6,})\.npz')


@dataclass(frozen=True)
class CheckpointConfig(Configuration):
    """Where and when a learner is saved."""

    checkpoint_folder: str = parameter(
        '', 'folder for checkpoints of what was learned; empty: none are written'
    )
    checkpoint_every_trials: int = parameter(
        10, 'save after so many learned trials; 0: only when asked, and at the end', low=0
    )
    checkpoints_kept: int = parameter(
        5, 'so many of the newest checkpoints of a learner are kept', low=1, high=100000
    )
    resume: bool = parameter(True, 'go on from the newest good checkpoint in the folder')


class Resumed(NamedTuple):
    """The checkpoint that a learner continues from, or None, and why others were refused."""

    path: Path | None
    refused: list[str]


class CheckpointFolder:
    """Files `<kind>-<number>.npz`; numbers rise for any learner, also after a reset.

    One process at a time has the folder: two learners would take each other's for their own.
    """

    def __init__(
        self, folder: Path, config: CheckpointConfig, origin: Origin | None = None
    ) -> None:
        """Make the folder if need be.

        `origin`: of the learner that is saved and restored; by default the strict one. Raises
        ConfigError when another process has it, or when it cannot be made.
        """
        self.folder = folder
        self.config = config
        self._origin = origin or Origin()
        self._saved_trials = 0
        self._lock = _lock(folder)
        for unfinished in folder.glob('.*.npz.*'):  # its writer was killed
            with suppress(OSError):
                unfinished.unlink()

    def close(self) -> None:
        """Let another process have the folder."""
        self._lock.close()

    def save(self, learner: Learner, remove_old: bool = True) -> Path:
        """Write all that was learned, and return the path. Raises as `save_checkpoint`."""
        number = max(map(_number, self._newest_first()), default=0) + 1
        path = self.folder / f'{learner.kind}-{number:06d}.npz'
        save_checkpoint(path, learner.state(), _description(learner, self._origin))
        self._saved_trials = learner.trials
        self._link(path)
        if remove_old:
            self._remove_old(learner.kind)
        return path

    def save_reset(self, learner: Learner) -> Path:
        """Write a learner that knows nothing, and keep what was learned before: see `go_back`."""
        return self.save(learner, remove_old=False)

    def go_back(self, learner: Learner) -> Resumed:
        """Restore the newest checkpoint, but one with trials where there is one.

        So what a reset has forgotten comes back. If it was not in the newest file it is saved
        again, so that a restart goes on from it, too. Raises as `resume_into` and `save`.
        """
        found = self.resume_into(learner, with_trials=True)
        if found.path is None:
            return self.resume_into(learner)
        if found.path != self._newest_first()[0]:
            self.save(learner)
        return found

    def save_when_due(self, learner: Learner) -> None:
        """Save if so many trials as configured were learned since the last time."""
        if 0 < self.config.checkpoint_every_trials <= learner.trials - self._saved_trials:
            self.save(learner)

    def save_when_changed(self, learner: Learner) -> None:
        """Save if anything was learned since the last time."""
        if learner.trials != self._saved_trials:
            self.save(learner)

    def resume_into(self, learner: Learner, with_trials: bool = False) -> Resumed:
        """Restore the newest whole checkpoint of this learner's configuration and track.

        `with_trials`: pass over those of a learner without trials.

        Raises ConfigError, and changes nothing, when there are checkpoints and none can be used:
        an untrained learner must not replace a trained one unnoticed.
        """
        refused, passed_over = [], False
        for path in self._newest_first():
            try:
                _restore_checkpoint(path, learner, self._origin)
            except (ValueError, OSError) as error:
                refused.append(str(error))
                continue
            if learner.trials or not with_trials:
                self._saved_trials = learner.trials
                return Resumed(path, refused)
            passed_over = True
        if refused and not passed_over:
            raise ConfigError(
                f'none of the {len(refused)} checkpoints in {self.folder} can be used; the newest:'
                f' {refused[0]}: fix that, or name another folder'
            )
        return Resumed(None, refused)

    def _newest_first(self) -> list[Path]:
        found = [path for path in self.folder.glob('*.npz') if _NAME.fullmatch(path.name)]
        return sorted(found, key=_number, reverse=True)

    def _remove_old(self, kind: str) -> None:
        ours = [path for path in self._newest_first() if _kind(path) == kind]
        for old in ours[self.config.checkpoints_kept :]:
            with suppress(OSError):  # the new one is saved all the same
                old.unlink()

    def _link(self, path: Path) -> None:
        temporary = self.folder / f'.{LAST}.{os.getpid()}'
        try:
            temporary.symlink_to(path.name)
            os.replace(temporary, self.folder / LAST)
        except OSError:
            pass  # a memory card's file system may know no links


def _lock(folder: Path) -> IO[bytes]:
    """Make a folder and lock it; return the file that holds the lock until it is closed."""
    path = folder / '.lock'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Only read: a learner starts again also where its disk has become full or read-only.
        lock = os.fdopen(os.open(path, os.O_RDONLY | os.O_CREAT, 0o666), 'rb')
    except OSError as error:
        raise ConfigError(why_not_written(path, error)) from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        lock.close()
        if not isinstance(error, BlockingIOError):
            raise ConfigError(f'{path} cannot be locked ({error.strerror})') from None
        raise ConfigError(
            f'{folder}: another learner keeps its checkpoints there: name another folder'
        ) from None
    return lock


def _restore_checkpoint(path: Path, learner: Learner, origin: Origin) -> None:
    """Restore a learner from a checkpoint.

    Raises FileNotFoundError, or ValueError with one sentence when the file is damaged, or of
    another learner, track or configuration; learner and origin are then as before.
    """
    arrays, theirs = load_checkpoint(path)
    ours = _description(learner, origin)
    if theirs.get('learner') != ours['learner']:
        raise ValueError(
            f'{path} is of the learner {theirs.get("learner")!r}, not {ours["learner"]!r}'
        )
    try:
        origin.check(theirs, learner.config)
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None
    made_with, wanted = theirs.get('configuration'), ours['configuration']
    if not isinstance(made_with, dict):
        raise ValueError(f'{path} does not say how its learner was configured')
    # A version that did not know a setting yet did what is its default now.
    made_with = {**asdict(type(learner.config)()), **made_with}
    for name in sorted(made_with.keys() | wanted.keys()):
        if made_with.get(name) != wanted.get(name):
            raise ValueError(
                f'{path} was made with {name} = {made_with.get(name)!r}, '
                f'here it is {wanted.get(name)!r}'
            )
    try:
        learner.restore(arrays)
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from None
    origin.resume(theirs)


def _description(learner: Learner, origin: Origin) -> dict[str, Any]:
    return {
        'learner': learner.kind,
        'configuration': asdict(learner.config),
        'trials': learner.trials,
        **origin.describe(learner.config),
    }


def _kind(path: Path) -> str:
    return path.name.rpartition('-')[0]


def _number(path: Path) -> int:
    return int(path.stem.rpartition('-')[2])
