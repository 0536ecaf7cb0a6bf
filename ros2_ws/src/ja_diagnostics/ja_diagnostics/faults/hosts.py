"""Faults that need hosts of their own: network and /dev/shm of no other process on this machine.

Linux gives them as namespaces, to root alone. `python -m ja_diagnostics.faults.hosts CASE FOLDER`
is the near host; what it makes ends with it.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ja_common.ros_defaults import apply_ros_defaults
from ja_diagnostics.faults.catalogue import Fault
from ja_diagnostics.faults.run import FaultRun, Outcome
from ja_runner.graph import NodeSpec

_RESULT = 'outcome.json'
_NEAR, _FAR = '10.77.0.1/24', '10.77.0.2/24'
_FULL_BYTES = 40 * 2**20
_SEGMENT_BYTES = 8 * 2**20
# A participant that dies without a word, and leaves its segment behind.
_DIES = 'import os, rclpy; rclpy.init(); node = rclpy.create_node("dies"); os.kill(os.getpid(), 9)'


@dataclass(frozen=True)
class _FarNode(NodeSpec):
    """A node in the namespaces of another process."""

    host: int = 0

    def command(self) -> list[str]:
        return ['nsenter', f'--target={self.host}', '--net', '--mount', '--', *super().command()]


def missing() -> str:
    """Why hosts cannot be made here; '' if they can."""
    if absent := [
        tool for tool in ('unshare', 'nsenter', 'ip', 'mount') if not shutil.which(tool)
    ]:
        return f'{", ".join(absent)} not found (util-linux and iproute2 have them)'
    tried = subprocess.run(
        ['unshare', '--net', '--mount', 'true'], capture_output=True, text=True, check=False
    )
    return '' if tried.returncode == 0 else f'{tried.stderr.strip()} (it takes root)'


def run_on_hosts(case: str, folder: Path, report: Callable[[str], None]) -> Outcome:
    """One of `CASES`, in a process that is a host; its outcome. Raises OSError when it fails."""
    folder.mkdir(parents=True)
    command = [sys.executable, '-m', __spec__.name, case, str(folder)]
    host = subprocess.Popen(
        ['unshare', '--net', '--mount', *command], stdout=subprocess.PIPE, text=True
    )
    assert host.stdout is not None
    try:
        for line in host.stdout:
            report(line.rstrip())
        host.wait()
    finally:
        host.send_signal(signal.SIGTERM)
    result = folder / _RESULT
    if not result.exists():
        raise OSError(f'{case}: the host ended with exit code {host.returncode}, logs in {folder}')
    values = json.loads(result.read_text())
    return Outcome(**{**values, 'lost': tuple(values['lost'])})


def _network_cut(folder: Path) -> Outcome:
    with _far_host() as host:
        # Safe here: no link leads out of these two hosts.
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'

        def place(graph: list[NodeSpec]) -> list[NodeSpec]:
            return [
                _FarNode(**{**vars(spec), 'host': host})
                if spec.thing == 'learning_module' else spec
                for spec in graph
            ]  # fmt: skip

        run = FaultRun(folder, _say, place)
        cut = Fault(
            'network to the learner cut',
            lambda _: _ip('link set near down'),
            lambda _: _ip('link set near up'),
        )
        return _one(run, cut)


def _full_of_dead_segments(folder: Path) -> Outcome:
    subprocess.run(['mount', '-o', f'remount,size={_FULL_BYTES}', '/dev/shm'], check=True)
    while shutil.disk_usage('/dev/shm').free > _SEGMENT_BYTES:
        subprocess.run([sys.executable, '-c', _DIES], check=False)
    run = FaultRun(folder, _say)
    (killed,) = [f for f in run.faults() if f.name == 'salient_feature_detector killed -9']
    return _one(run, replace(killed, name=f'{killed.name}, /dev/shm full of dead segments'))


CASES = {'network': _network_cut, 'segments': _full_of_dead_segments}


def _one(run: FaultRun, fault: Fault) -> Outcome:
    run.run([fault])
    return run.outcomes[0]


@contextmanager
def _far_host() -> Iterator[int]:
    """Another host at the end of a wire; the process id that its namespaces are known by."""
    # It waits for the end of its input, and so does not outlive us.
    holds = 'mount -t tmpfs tmpfs /dev/shm && ip link set lo up && echo ready && cat'
    far = subprocess.Popen(
        ['unshare', '--net', '--mount', 'sh', '-c', holds],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    assert far.stdout is not None
    try:
        far.stdout.readline()
        _ip(f'link add near type veth peer name far netns {far.pid}')
        _ip(f'address add {_NEAR} dev near')
        _ip('link set near up')
        there = ['nsenter', f'--target={far.pid}', '--net', 'ip']
        for order in (f'address add {_FAR} dev far', 'link set far up'):
            subprocess.run([*there, *order.split()], check=True)
        yield far.pid
    finally:
        far.communicate()


def _ip(order: str) -> None:
    subprocess.run(['ip', *order.split()], check=True)


def _say(line: str) -> None:
    print(line, flush=True)


def main() -> None:
    """Be the near host: the namespaces are there already, and empty."""
    case, folder = sys.argv[1], Path(sys.argv[2])
    subprocess.run(['mount', '-t', 'tmpfs', 'tmpfs', '/dev/shm'], check=True)
    _ip('link set lo up')
    apply_ros_defaults()
    outcome = CASES[case](folder)
    (folder / _RESULT).write_text(json.dumps(asdict(outcome)))


if __name__ == '__main__':
    main()
