"""What has to be done before the first node can start: pure decisions, no file or process."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

SUPPORTED = ((3, 10), (3, 13))

DISTRO_LOCKS = {'jazzy': 'ros.lock', 'kilted': 'ros-kilted.lock'}
"""The ROS distributions that the graph runs on, and the lock file of the wheels of each."""

JA_ROS_DISTRO = 'JA_ROS_DISTRO'
"""Environment variable: which distribution's wheels are installed where none is sourced."""

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


@dataclass(frozen=True)
class SystemPackage:
    """A package of the system that is missing: Debian's name, and what it is needed for.

    `vital`: the set-up cannot go on without it.
    """

    name: str
    why: str
    vital: bool = False


def ros_is_sourced(environ: Mapping[str, str]) -> bool:
    """Return whether a ROS 2 is sourced on which the graph runs.

    Raises BootstrapError when it is another distribution, or not the one of JA_ROS_DISTRO.
    """
    distro, wanted = environ.get('ROS_DISTRO', ''), environ.get(JA_ROS_DISTRO, '')
    if distro and distro not in DISTRO_LOCKS:
        raise BootstrapError(
            f'ROS 2 {distro} is sourced here, but this system runs on {_or(DISTRO_LOCKS)}: open a '
            f'shell without it, or source {_or(DISTRO_LOCKS)}'
        )
    if distro and wanted and distro != wanted:
        raise BootstrapError(
            f'ROS 2 {distro} is sourced here, but {JA_ROS_DISTRO} is {wanted}: unset it to use '
            'the sourced one, or open a shell without ROS'
        )
    return bool(distro)


def distro_of_wheels(wanted: str | None, installed: str | None = None) -> str:
    """Return which distribution's wheels to install.

    `wanted` is the user's JA_ROS_DISTRO; without it those that are installed stay, and the first
    ones are of Jazzy. Raises BootstrapError for one on which the graph does not run.
    """
    distro = wanted or installed or 'jazzy'
    if distro not in DISTRO_LOCKS:
        raise BootstrapError(f'{JA_ROS_DISTRO}={distro}: this system runs on {_or(DISTRO_LOCKS)}')
    return distro


def _or(names: Iterable[str]) -> str:
    return ' or '.join(names)


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
        'ROS 2 is sourced, but no Python here can import its rclpy: name the one it '
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


def is_stamp(stamp: object) -> bool:
    """Return whether this is a stamp as the set-up writes it, and not what remains of one."""
    if not isinstance(stamp, dict):
        return False
    python, without = stamp.get('python', {}), stamp.get('without', [])
    distro = stamp.get('ros', 'jazzy')
    version = python.get('version', [0, 0]) if isinstance(python, dict) else None
    return (
        isinstance(version, list)
        and [type(part) for part in version] == [int, int]
        and (python == {} or isinstance(python.get('executable'), str))
        and isinstance(distro, str)
        and isinstance(without, list)
        and all(isinstance(part, str) for part in without)
    )


def steps_to_do(steps: Iterable[Step], stamp: Mapping[str, str]) -> list[Step]:
    """Return the steps that are missing or outdated; after a new environment, all that follow."""
    todo: list[Step] = []
    for step in steps:
        renewed = bool(todo) and todo[0].name == 'environment'
        if renewed or stamp.get(step.name) != step.fingerprint:
            todo.append(step)
    return todo


NO_SYSTEM_PACKAGES = 'JA_NO_SYSTEM_PACKAGES'
"""Environment variable: unless empty or 0, no system package is installed, nor asked for."""


def listed(packages: Iterable[SystemPackage]) -> str:
    """Return the names of system packages, and what they are needed for: `a, b (for this)`."""
    names_of: dict[str, list[str]] = {}
    for package in packages:
        names_of.setdefault(package.why, []).append(package.name)
    return ', '.join(f'{", ".join(names)} ({why})' for why, names in names_of.items())


def left_out(packages: Iterable[SystemPackage], environ: Mapping[str, str]) -> bool:
    """Return whether the user wants no system packages.

    Raises BootstrapError when the set-up cannot go on without one of them.
    """
    if environ.get(NO_SYSTEM_PACKAGES, '') in ('', '0'):
        return False
    vital = [package for package in packages if package.vital]
    if vital:
        raise BootstrapError(
            f'{NO_SYSTEM_PACKAGES} is set, but the set-up cannot go on without {listed(vital)}: '
            'install it, or name another Python with JA_PYTHON=/path/to/python'
        )
    return True


def apt_advice(packages: Iterable[SystemPackage], is_root: bool, has_apt: bool) -> str | None:
    """Return the sentence for a user who must install system packages; None when we can."""
    if is_root and has_apt:
        return None
    missing = list(packages)
    choice = f'{NO_SYSTEM_PACKAGES}=1 before the command goes on without'
    if has_apt:
        names = ' '.join(package.name for package in missing)
        command = f'sudo apt-get update && sudo apt-get install -y {names}'
        return f'missing are {listed(missing)}; {choice}; install them with: {command}'
    return (
        f'system libraries are missing, by their names in Debian: {listed(missing)}; install them '
        f'with your package manager; {choice}'
    )
