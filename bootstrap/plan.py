"""What has to be done before the first node can start: pure decisions, no file or process."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

SUPPORTED = ((3, 10), (3, 13))
ROS_DISTRO = 'jazzy'

PARTS = {
    'sim': ('ja_sim',),
    'dashboard': ('ja_dashboard',),
    'experiments': ('ja_experiments', 'ja_benchmarks'),
}
"""What a rig may leave out by JA_WITHOUT: packages by part; each part has its own lock file."""

_NEEDS = {'experiments': 'sim'}


class BootstrapError(Exception):
    """The set-up cannot go on; the message says what to do."""


@dataclass(frozen=True)
class Python:
    """An interpreter that was started once: a name on PATH alone may be an empty shim."""

    executable: str
    version: tuple[int, int]
    has_rclpy: bool = False
    has_ensurepip: bool = True

    @property
    def supported(self) -> bool:
        """Return whether the system runs on this version."""
        return SUPPORTED[0] <= self.version <= SUPPORTED[1]


def ros_is_sourced(environ: Mapping[str, str]) -> bool:
    """Return whether ROS 2 Jazzy is sourced.

    Raises BootstrapError when it is another distribution.
    """
    distro = environ.get('ROS_DISTRO', '')
    if distro and distro != ROS_DISTRO:
        raise BootstrapError(
            f'ROS 2 {distro} is sourced here, but this system runs on {ROS_DISTRO}: open a shell '
            f'without it, or source {ROS_DISTRO}'
        )
    return bool(distro)


def parts_left_out(text: str) -> tuple[str, ...]:
    """Return the parts that JA_WITHOUT leaves out, with those that need one of them, sorted.

    `text`: names of parts, separated by spaces or commas. Raises BootstrapError for another name.
    """
    named = set(text.replace(',', ' ').split())
    unknown = sorted(named - set(PARTS))
    if unknown:
        raise BootstrapError(
            f'JA_WITHOUT={text}: no part is called {", ".join(unknown)}; there are '
            f'{", ".join(PARTS)}'
        )
    return tuple(sorted(named | {part for part, needed in _NEEDS.items() if needed in named}))


def choose_python(
    candidates: Iterable[Python], wanted: str | None = None, sourced: bool = False
) -> Python:
    """Return the interpreter of the environment: the first candidate that can be used.

    `wanted` is the user's JA_PYTHON; then the only candidate is that one. With ROS sourced, it
    must be the Python that rclpy was built for. Raises BootstrapError when there is none.
    """
    lowest, highest = ('.'.join(map(str, version)) for version in SUPPORTED)
    found = list(candidates)
    if wanted and not found:
        raise BootstrapError(f'JA_PYTHON={wanted} is not a Python that can be started')
    usable = [python for python in found if python.supported]
    if not usable:
        versions = ', '.join('{}.{}'.format(*python.version) for python in found) or 'none'
        what = f'JA_PYTHON={wanted}' if wanted else 'every Python on PATH'
        raise BootstrapError(
            f'Python {lowest} to {highest} is needed, but {what} is of another version '
            f'({versions}): install one, or name it with JA_PYTHON=/path/to/python'
        )
    if not sourced:
        return usable[0]
    for python in usable:
        if python.has_rclpy:
            return python
    raise BootstrapError(
        f'ROS 2 {ROS_DISTRO} is sourced, but no Python here can import its rclpy: name the one it '
        'was built for with JA_PYTHON=/path/to/python, or open a shell without ROS'
    )


@dataclass(frozen=True)
class Step:
    """One step of the set-up, done again when its fingerprint differs from the stamped one."""

    name: str
    fingerprint: str


def fingerprint(*parts: str | bytes) -> str:
    """Return a short digest of everything that a step depends on."""
    digest = hashlib.sha256()
    for part in parts:
        data = part if isinstance(part, bytes) else part.encode()
        digest.update(len(data).to_bytes(8, 'big') + data)
    return digest.hexdigest()[:16]


def steps_to_do(steps: Iterable[Step], stamp: Mapping[str, str]) -> list[Step]:
    """Return the steps that are missing or outdated; after a new environment, all that follow."""
    todo: list[Step] = []
    for step in steps:
        renewed = bool(todo) and todo[0].name == 'environment'
        if renewed or stamp.get(step.name) != step.fingerprint:
            todo.append(step)
    return todo


def apt_advice(packages: Iterable[str], is_root: bool, has_apt: bool) -> str | None:
    """Return the sentence for a user who must install system packages; None when we can."""
    names = ' '.join(packages)
    if is_root and has_apt:
        return None
    if has_apt:
        command = f'sudo apt-get update && sudo apt-get install -y {names}'
        return f'system packages are missing; install them with: {command}'
    return (
        'system libraries are missing (Debian names them '
        f'{names}): install them with your package manager'
    )
