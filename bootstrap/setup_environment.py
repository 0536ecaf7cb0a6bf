"""Carry out the plan: system packages, virtual environment, wheels, our packages."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bootstrap import machine
from bootstrap.plan import (
    DISTRO_LOCKS,
    JA_ROS_DISTRO,
    NO_SYSTEM_PACKAGES,
    PARTS,
    BootstrapError,
    Python,
    Step,
    SystemPackage,
    apt_advice,
    choose_python,
    distro_of_wheels,
    fingerprint,
    is_stamp,
    left_out,
    listed,
    parts_left_out,
    ros_is_sourced,
    steps_to_do,
)

STAMP = 'ja-stamp.json'
# The only one without hashes: the machine chooses a build for its CPU or its GPU.
TORCH_LOCK = 'torch.lock'
_OFFLINE = ('NewConnectionError', 'Failed to establish', 'NameResolution', 'Temporary failure')


@dataclass
class Environment:
    """The virtual environment of a checkout, and what was done to it (the stamp)."""

    root: Path
    environ: Mapping[str, str]
    report: Callable[[str], None] = field(
        default=lambda text: print(f'ja: {text}', file=sys.stderr)
    )

    @property
    def folder(self) -> Path:
        """Return the folder of the virtual environment."""
        return self.root / '.venv'

    @property
    def python(self) -> str:
        """Return the path of the environment's interpreter."""
        return str(self.folder / 'bin' / 'python')

    @property
    def script(self) -> str:
        """Return the path of the commands' script, which ja_bringup installs."""
        return str(self.folder / 'bin' / 'ja')

    @property
    def log(self) -> Path:
        """Return the file that holds the output of every command."""
        return self.root / 'runs' / 'setup.log'

    def packages(self, without: Iterable[str] = ()) -> list[Path]:
        """Return the folders of our packages, but those of the parts in `without`."""
        left_out = {package for part in without for package in PARTS[part]}
        found = sorted(path.parent for path in self.root.glob('ros2_ws/src/*/setup.py'))
        return [folder for folder in found if folder.name not in left_out]

    def prepare(self, dev: bool = False, docs: bool = False) -> None:
        """Make everything ready that is not; raises BootstrapError with one clear sentence.

        Safe to interrupt and to run twice at once: a step is stamped when it is done, and one
        process works at a time.
        """
        sourced = ros_is_sourced(self.environ)
        extra = [lock for lock, wanted in (('dev.lock', dev), ('docs.lock', docs)) if wanted]
        # The tests need every part.
        without = () if dev else self._without()
        if self._is_ready(sourced, extra, without):
            return
        with self._only_one():
            python = self._choose_python(sourced)
            system = machine.missing_system_packages(python, renders='sim' not in without)
            self._install_system_packages(system)
            steps = self._steps(python.version, sourced, extra, without)
            for step in steps_to_do(steps, self._stamp()):
                self._do(step, python, without)
            if not dev:
                self._record('without', list(without))

    def _without(self) -> tuple[str, ...]:
        """Return the parts to leave out: those of JA_WITHOUT, or else those of the last run."""
        text = self.environ.get('JA_WITHOUT')
        if text is None:
            text = ' '.join(self._stamp().get('without', ()))
        return parts_left_out(text)

    def _distro(self) -> str:
        """Return which wheels of ROS to install: JA_ROS_DISTRO, or else those of the last run."""
        return distro_of_wheels(self.environ.get(JA_ROS_DISTRO), self._stamp().get('ros'))

    def _is_ready(self, sourced: bool, extra: Sequence[str], without: Sequence[str]) -> bool:
        """Return whether nothing is to do, without starting an interpreter."""
        wanted = self.environ.get('JA_PYTHON')
        recorded = self._stamp().get('python', {})
        if not recorded:
            return False
        if wanted and shutil.which(wanted) != recorded.get('asked'):
            return False
        # A part left out for the first time is remembered, though no step is outdated.
        remembered = self._stamp().get('without', [])
        if 'dev.lock' not in extra and list(without) != remembered:
            return False
        version = tuple(recorded['version'])
        return not steps_to_do(self._steps(version, sourced, extra, without), self._stamp())

    def _steps(
        self,
        version: tuple[int, int],
        sourced: bool,
        extra: Sequence[str],
        without: Sequence[str],
    ) -> list[Step]:
        """Return the steps in their order: each needs those before it."""
        locks, distro = self.root / 'requirements', self._distro()
        wanted = [
            *([] if sourced else [DISTRO_LOCKS[distro]]),
            'base.lock',
            TORCH_LOCK,
            *(f'{part}.lock' for part in PARTS if part not in without),
        ]
        wheels = 'wheels' if distro == 'jazzy' else f'{distro} wheels'
        ros = self.environ.get('AMENT_PREFIX_PATH', '') if sourced else wheels
        steps = [
            Step('environment', fingerprint('{}.{}'.format(*version), ros, str(self.root))),
            *(Step(lock, fingerprint((locks / lock).read_bytes())) for lock in wanted),
            Step(
                'packages',
                fingerprint(
                    *(
                        (package / name).read_bytes()
                        for package in self.packages(without)
                        for name in ('setup.py', 'setup.cfg', 'package.xml')
                    )
                ),
            ),
        ]
        steps += [Step(lock, fingerprint((locks / lock).read_bytes())) for lock in extra]
        return steps

    def _choose_python(self, sourced: bool) -> Python:
        existing = self._stamp().get('python', {}).get('executable')
        candidates = machine.pythons(self.environ, existing)
        return choose_python(candidates, self.environ.get('JA_PYTHON'), sourced)

    def _install_system_packages(self, missing: Sequence[SystemPackage]) -> None:
        if not missing:
            return
        if left_out(missing, self.environ):
            self.report(f'left out, as {NO_SYSTEM_PACKAGES} wants it: {listed(missing)}')
            return
        advice = apt_advice(missing, machine.is_root(), machine.has_apt())
        if advice:
            raise BootstrapError(advice)
        self.report(
            f'installing system packages with apt-get: {listed(missing)}; '
            f'{NO_SYSTEM_PACKAGES}=1 would leave them out'
        )
        names = [package.name for package in missing]
        apt = {**self.environ, 'DEBIAN_FRONTEND': 'noninteractive'}
        self._run(['apt-get', 'update'], apt)
        self._run(['apt-get', 'install', '-y', '--no-install-recommends', *names], apt)

    def _do(self, step: Step, python: Python, without: Sequence[str]) -> None:
        began = time.monotonic()
        if step.name == 'environment':
            self.report(
                'making the virtual environment .venv (Python {}.{})'.format(*python.version)
            )
            distro = self._distro()
            self._write_stamp({})
            self._run([python.executable, '-I', '-m', 'venv', '--clear', str(self.folder)])
            asked = shutil.which(self.environ.get('JA_PYTHON', '')) or python.executable
            self._record(
                'python',
                {
                    'executable': python.executable,
                    'version': python.version,
                    'asked': asked,
                },
            )
            # At once: an interrupted set-up continues with the same parts and the same ROS.
            self._record('without', list(without))
            self._record('ros', distro)
        elif step.name == 'packages':
            self.report('installing the packages of ros2_ws')
            self._pip(
                '--no-deps',
                '--no-build-isolation',
                '--use-pep517',
                # A plain path entry: quick to import, and followed by mypy and editors.
                '--config-settings',
                'editable_mode=compat',
                *(part for package in self.packages(without) for part in ('-e', str(package))),
            )
        else:
            lock = self.root / 'requirements' / step.name
            self.report(f'installing requirements/{step.name} (the first time takes minutes)')
            hashes = [] if step.name == TORCH_LOCK else ['--require-hashes']
            self._pip('--prefer-binary', *hashes, '-r', str(lock))
        self._record(step.name, step.fingerprint)
        self.report(f'  done in {time.monotonic() - began:.0f} s')

    def _pip(self, *args: str) -> None:
        # -I, as above: a file `pip.py` in the current folder, or in PYTHONPATH, is not pip.
        pip = [self.python, '-I', '-m', 'pip', '--disable-pip-version-check']
        self._run([*pip, 'install', *args])

    def _run(self, command: Sequence[str], environ: Mapping[str, str] | None = None) -> None:
        """Run a command, its output into the log; raises BootstrapError when it fails."""
        self.log.parent.mkdir(exist_ok=True)
        with self.log.open('a', encoding='utf-8') as log:
            start = log.seek(0, os.SEEK_END)
            log.write(f'$ {" ".join(command)}\n')
            log.flush()
            try:
                result = subprocess.run(
                    command,
                    env=machine.clean_environ(environ or self.environ),
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    check=False,
                )
            except OSError as error:
                raise BootstrapError(f'{command[0]} cannot be started: {error}') from error
        if result.returncode:
            with self.log.open(encoding='utf-8', errors='replace') as log:
                log.seek(start)
                raise BootstrapError(self._why(command, log.read()))

    def _why(self, command: Sequence[str], output: str) -> str:
        if any(sign in output for sign in _OFFLINE):
            return (
                'the first set-up needs the network to fetch its packages, and could not reach '
                f'it: connect, then run the same command again (log: {self.log})'
            )
        errors = [line for line in output.splitlines() if line.lower().startswith(('error', 'e:'))]
        last = errors[-1] if errors else output.strip().rsplit('\n', 1)[-1]
        return f'{" ".join(command[:4])} ... failed: {last} (log: {self.log})'

    def _stamp(self) -> dict:
        """Return what was done; {} when the interpreter is gone (its link leads nowhere)."""
        if not os.path.exists(self.python):
            return {}
        try:
            stamp = json.loads((self.folder / STAMP).read_text())
        except (OSError, ValueError, RecursionError):
            return {}
        return stamp if is_stamp(stamp) else {}

    def _record(self, name: str, value: object) -> None:
        self._write_stamp({**self._stamp(), name: value})

    def _write_stamp(self, stamp: dict) -> None:
        self.folder.mkdir(exist_ok=True)
        temporary = self.folder / f'{STAMP}.new'
        temporary.write_text(json.dumps(stamp, indent=1))
        temporary.replace(self.folder / STAMP)

    @contextlib.contextmanager
    def _only_one(self) -> Iterator[None]:
        with (self.root / '.ja.lock').open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                self.report('another set-up is under way; waiting for it')
                fcntl.flock(lock, fcntl.LOCK_EX)
            yield
