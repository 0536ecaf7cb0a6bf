"""The set-up's course with the commands recorded instead of run, on a checkout of its own."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from bootstrap import machine, setup_environment
from bootstrap.machine import clean_environ, probe_python
from bootstrap.plan import PARTS, BootstrapError, Python, SystemPackage
from bootstrap.setup_environment import STAMP, Environment

ROOT = Path(__file__).parents[2]
PART_LOCKS = [f'{part}.lock' for part in PARTS]


class Recorded(Environment):
    """Does not run anything; `fail_at` is a word of the command that is interrupted."""

    def __init__(self, root: Path, environ: dict[str, str] | None = None) -> None:
        self.reports: list[str] = []
        super().__init__(root, environ or {}, report=self.reports.append)
        self.commands: list[str] = []
        self.fail_at = ''

    def _run(self, command, environ=None):
        text = ' '.join(command)
        if self.fail_at and self.fail_at in text:
            raise KeyboardInterrupt
        self.commands.append(text)
        if '-m venv' in text:
            python = Path(self.python)
            python.parent.mkdir(parents=True, exist_ok=True)
            python.touch()

    def did(self) -> list[str]:
        """Return the word of each command that names its step, in order, and forget them."""
        words = ('-m venv', '.lock', '-e ', 'apt-get')
        found = [
            text.rsplit('/', 1)[1] if word == '.lock' else word
            for text in self.commands
            for word in words
            if word in text
        ]
        self.commands = []
        return found


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ('ja_one', *(package for part in PARTS.values() for package in part)):
        package = tmp_path / 'ros2_ws' / 'src' / name
        package.mkdir(parents=True)
        for file in ('setup.py', 'setup.cfg', 'package.xml'):
            (package / file).touch()
    (tmp_path / 'requirements').mkdir()
    for name in ('ros', 'ros-kilted', 'base', 'torch', 'dev', 'docs', *PARTS):
        (tmp_path / 'requirements' / f'{name}.lock').write_text(name)
    monkeypatch.setattr(machine, 'missing_system_packages', lambda python, renders: [])
    monkeypatch.setattr(
        machine, 'pythons', lambda environ, existing: [Python('python3.12', (3, 12), True)]
    )
    return tmp_path


def test_all_the_steps_once_and_then_none(checkout):
    environment = Recorded(checkout)
    environment.prepare()
    assert environment.did() == [
        '-m venv',
        'ros.lock',
        'base.lock',
        'torch.lock',
        *PART_LOCKS,
        '-e ',
    ]
    environment.prepare()
    assert environment.did() == []


def test_tests_need_one_step_more(checkout):
    environment = Recorded(checkout)
    environment.prepare()
    environment.did()
    environment.prepare(dev=True)
    assert environment.did() == ['dev.lock']
    environment.prepare()
    assert environment.did() == []


def test_the_pages_need_one_step_more(checkout):
    environment = Recorded(checkout)
    environment.prepare()
    environment.did()
    environment.prepare(docs=True)
    assert environment.did() == ['docs.lock']


def installed(environment: Recorded) -> set[str]:
    """Return the names of our packages that the last command installed."""
    return {Path(word).name for word in environment.commands[-1].split() if 'ros2_ws' in word}


def test_a_rig_leaves_out_the_parts_that_it_does_not_need(checkout):
    environment = Recorded(checkout, {'JA_WITHOUT': 'sim dashboard experiments'})
    environment.prepare()
    assert installed(environment) == {'ja_one'}
    assert environment.did() == ['-m venv', 'ros.lock', 'base.lock', 'torch.lock', '-e ']


def test_what_is_left_out_is_remembered_and_may_be_added_later(checkout):
    Recorded(checkout, {'JA_WITHOUT': 'dashboard'}).prepare()
    environment = Recorded(checkout)
    environment.prepare()
    assert environment.did() == []
    environment = Recorded(checkout, {'JA_WITHOUT': ''})
    environment.prepare()
    assert 'ja_dashboard' in installed(environment)
    assert environment.did() == ['dashboard.lock', '-e ']


def test_a_part_that_is_left_out_of_a_full_environment_is_remembered(checkout):
    Recorded(checkout).prepare()
    Recorded(checkout, {'JA_WITHOUT': 'sim'}).prepare()
    (checkout / 'requirements' / 'sim.lock').write_text('newer')
    environment = Recorded(checkout)
    environment.prepare()
    assert environment.did() == []


def test_an_interrupted_setup_remembers_what_is_left_out(checkout):
    environment = Recorded(checkout, {'JA_WITHOUT': 'sim'})
    environment.fail_at = 'base.lock'
    with pytest.raises(KeyboardInterrupt):
        environment.prepare()
    environment = Recorded(checkout)
    environment.prepare()
    assert environment.did() == ['base.lock', 'torch.lock', 'dashboard.lock', '-e ']


def test_the_tests_need_every_part(checkout):
    environment = Recorded(checkout, {'JA_WITHOUT': 'sim'})
    environment.prepare()
    environment.did()
    environment.prepare(dev=True)
    assert environment.did() == ['sim.lock', 'experiments.lock', '-e ', 'dev.lock']


def test_a_changed_lock_is_installed_again(checkout):
    environment = Recorded(checkout)
    environment.prepare()
    environment.did()
    (checkout / 'requirements' / 'base.lock').write_text('newer')
    environment.prepare()
    assert environment.did() == ['base.lock']


def test_an_interrupted_setup_goes_on_where_it_was(checkout):
    environment = Recorded(checkout)
    environment.fail_at = 'base.lock'
    with pytest.raises(KeyboardInterrupt):
        environment.prepare()
    assert environment.did() == ['-m venv', 'ros.lock']
    environment.fail_at = ''
    environment.prepare()
    assert environment.did() == ['base.lock', 'torch.lock', *PART_LOCKS, '-e ']


def test_a_damaged_stamp_or_a_lost_environment_means_a_new_one(checkout):
    environment = Recorded(checkout)
    environment.prepare()
    environment.did()
    (environment.folder / STAMP).write_text('{"environment": ')
    environment.prepare()
    assert environment.did()[0] == '-m venv'
    Path(environment.python).unlink()
    environment.prepare()
    assert environment.did()[0] == '-m venv'


def test_where_ros_is_sourced_no_ros_wheel_is_installed(checkout):
    sourced = {'ROS_DISTRO': 'jazzy', 'AMENT_PREFIX_PATH': '/opt/ros/jazzy'}
    environment = Recorded(checkout, sourced)
    environment.prepare()
    assert environment.did() == ['-m venv', 'base.lock', 'torch.lock', *PART_LOCKS, '-e ']
    # And the other way round: the same checkout in a shell without ROS.
    environment = Recorded(checkout, {})
    environment.prepare()
    assert environment.did() == [
        '-m venv',
        'ros.lock',
        'base.lock',
        'torch.lock',
        *PART_LOCKS,
        '-e ',
    ]


def test_the_wheels_of_another_distribution_are_chosen_and_remembered(checkout):
    Recorded(checkout).prepare()
    environment = Recorded(checkout, {'JA_ROS_DISTRO': 'kilted'})
    environment.prepare()
    assert environment.did()[:3] == ['-m venv', 'ros-kilted.lock', 'base.lock']
    environment = Recorded(checkout)
    environment.prepare()
    assert environment.did() == []
    environment = Recorded(checkout, {'JA_ROS_DISTRO': 'jazzy'})
    environment.prepare()
    assert environment.did()[:3] == ['-m venv', 'ros.lock', 'base.lock']


def test_an_interrupted_setup_goes_on_with_the_same_distribution(checkout):
    environment = Recorded(checkout, {'JA_ROS_DISTRO': 'kilted'})
    environment.fail_at = 'base.lock'
    with pytest.raises(KeyboardInterrupt):
        environment.prepare()
    environment = Recorded(checkout)
    environment.prepare()
    assert environment.did()[0] == 'base.lock'


EGL = SystemPackage('libegl1', 'to render the simulated world without a display')
VENV = SystemPackage('python3.12-venv', 'to make the virtual environment', vital=True)


@pytest.fixture
def lacking(monkeypatch: pytest.MonkeyPatch):
    """Return a function that makes system packages missing, for root or for another user."""

    def lack(*packages: SystemPackage, root: bool = True) -> None:
        monkeypatch.setattr(machine, 'missing_system_packages', lambda *_, **__: list(packages))
        monkeypatch.setattr(machine, 'is_root', lambda: root)
        monkeypatch.setattr(machine, 'has_apt', lambda: True)

    return lack


def test_system_packages_are_installed_by_root_after_saying_which_and_why(checkout, lacking):
    lacking(VENV, EGL)
    environment = Recorded(checkout)
    environment.prepare()
    assert environment.commands[0] == 'apt-get update'
    assert environment.commands[1].endswith('python3.12-venv libegl1')
    [said] = [line for line in environment.reports if 'apt-get' in line]
    assert 'libegl1 (to render the simulated world without a display)' in said
    assert 'python3.12-venv (to make the virtual environment)' in said
    assert 'JA_NO_SYSTEM_PACKAGES=1 would leave them out' in said


@pytest.mark.parametrize('root', [True, False])
def test_system_packages_can_be_left_out_and_what_will_be_missing_is_said(checkout, lacking, root):
    lacking(EGL, root=root)
    environment = Recorded(checkout, {'JA_NO_SYSTEM_PACKAGES': '1'})
    environment.prepare()
    assert environment.did()[0] == '-m venv'
    [said] = [line for line in environment.reports if 'left out' in line]
    assert 'libegl1 (to render the simulated world without a display)' in said


def test_what_the_set_up_itself_needs_cannot_be_left_out(checkout, lacking):
    lacking(VENV, EGL)
    environment = Recorded(checkout, {'JA_NO_SYSTEM_PACKAGES': 'yes'})
    with pytest.raises(BootstrapError, match=r'cannot go on without python3\.12-venv \(to make'):
        environment.prepare()
    assert environment.commands == []


@pytest.mark.parametrize('value', ['', '0'])
def test_an_empty_variable_leaves_nothing_out(checkout, lacking, value):
    lacking(EGL)
    environment = Recorded(checkout, {'JA_NO_SYSTEM_PACKAGES': value})
    environment.prepare()
    assert environment.commands[0] == 'apt-get update'


def test_missing_system_packages_are_named_to_others(checkout, lacking):
    lacking(EGL, root=False)
    environment = Recorded(checkout)
    with pytest.raises(BootstrapError, match=r'libegl1.*JA_NO_SYSTEM_PACKAGES=1'):
        environment.prepare()
    assert environment.commands == []


def test_pip_takes_only_files_whose_hashes_are_in_the_locks_but_for_torch(checkout):
    environment = Recorded(checkout)
    environment.prepare(dev=True, docs=True)
    locks = [text for text in environment.commands if text.endswith('.lock')]
    assert len(locks) == 5 + len(PARTS)
    unhashed = [text for text in locks if '--require-hashes' not in text]
    assert [text.rsplit('/', 1)[1] for text in unhashed] == ['torch.lock']


@pytest.mark.parametrize(
    'stamp',
    ['5', '[]', '{"python": 5}', '{"python": {}, "without": 5}', '{"python": {"version": "x"}}',
     '{"python": {"version": [3]}}', '{"python": {"version": [3, 12]}}', '[' * 10**5,
     '{"without": [1]}', '\0'],
    ids=lambda text: text[:30],
)  # fmt: skip
def test_a_stamp_that_makes_no_sense_means_a_new_environment(checkout, stamp):
    environment = Recorded(checkout)
    environment.prepare()
    environment.did()
    (environment.folder / STAMP).write_text(stamp)
    environment.prepare()
    assert environment.did()[0] == '-m venv'


@pytest.mark.parametrize(
    ('output', 'expected'),
    [
        ('ERROR: No matching distribution found for nonsense==1', 'No matching distribution'),
        ('connection: NewConnectionError(...)\nERROR: No matching', 'needs the network'),
    ],
)
def test_a_failing_command_is_explained_and_logged(tmp_path, output, expected):
    environment = Environment(tmp_path, {}, report=lambda _: None)
    with pytest.raises(BootstrapError, match=expected):
        environment._run([sys.executable, '-c', f'print({output!r}); raise SystemExit(1)'])
    assert output in environment.log.read_text()


def test_two_setups_at_once_wait_for_each_other(checkout):
    """The second process finds everything done by the first one."""
    first, second = Recorded(checkout), Recorded(checkout)
    with first._only_one(), pytest.raises(BlockingIOError):
        setup_environment.fcntl.flock(
            (checkout / '.ja.lock').open('w'),
            setup_environment.fcntl.LOCK_EX | setup_environment.fcntl.LOCK_NB,
        )
    first.prepare()
    second.prepare()
    assert second.did() == []


def test_a_python_is_asked_what_it_is():
    python = probe_python(sys.executable, {})
    assert python is not None
    assert python.version == sys.version_info[:2]
    assert probe_python('no-such-python', {}) is None


def test_another_environments_libraries_are_left_behind():
    inherited = {
        '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1',
        'LD_LIBRARY_PATH': '/a/lib/python3.11/site-packages/ros_rcl.libs:/usr/local/cuda/lib',
    }
    assert clean_environ(inherited) == {'LD_LIBRARY_PATH': '/usr/local/cuda/lib'}
    assert clean_environ({'LD_LIBRARY_PATH': '/x'}) == {'LD_LIBRARY_PATH': '/x'}


def test_another_ros_distribution_is_refused_in_one_sentence():
    answer = subprocess.run(
        [sys.executable, str(ROOT / 'ja'), 'demo'],
        env={'ROS_DISTRO': 'humble', 'PATH': '/usr/bin:/bin'},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert answer.returncode == 1
    assert answer.stderr.startswith('ja: ROS 2 humble is sourced')
    assert answer.stderr.count('\n') == 1


def test_the_stamp_of_this_environment_is_complete():
    """The suite runs in an environment that `ja` made."""
    stamp = json.loads((ROOT / '.venv' / STAMP).read_text())
    assert {'environment', 'base.lock', 'packages', 'dev.lock', 'python'} <= set(stamp)
