"""Faults that need hosts of their own: a network and a /dev/shm that no other process uses.

Linux makes them as namespaces, for root only. `python -m ja_diagnostics.faults.hosts CASE FOLDER`
runs inside the near host; all that it makes ends with it.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ja_common.python_command import code_command, module_command
from ja_common.ros_defaults import apply_ros_defaults
from ja_diagnostics.faults import intruder
from ja_diagnostics.faults.cable import FAR, NEAR
from ja_diagnostics.faults.catalogue import Fault, Graph
from ja_diagnostics.faults.run import FaultOutcome, FaultRun
from ja_runner.node_spec import NodeSpec

_RESULT = 'outcome.json'
_NEAR_ADDRESS, _FAR_ADDRESS = '10.77.0.1/24', '10.77.0.2/24'
_FULL_BYTES = 40 * 2**20
_SEGMENT_BYTES = 8 * 2**20
_INTRUDER_S = 5.0
_PLUG_PATIENCE_S = 10.0
# A participant that kills itself, and leaves its segment behind.
_DIES = 'import os, rclpy; rclpy.init(); node = rclpy.create_node("dies"); os.kill(os.getpid(), 9)'


@dataclass(frozen=True)
class _FarNode(NodeSpec):
    """A node in the namespaces of another process."""

    host: int = 0

    def command(self) -> list[str]:
        """Return the command line that runs the node on the other host."""
        return ['nsenter', f'--target={self.host}', '--net', '--mount', '--', *super().command()]


def missing() -> str:
    """Return why hosts cannot be made here; '' if they can."""
    if absent := [
        tool for tool in ('unshare', 'nsenter', 'ip', 'mount') if not shutil.which(tool)
    ]:
        return f'{", ".join(absent)} not found (util-linux and iproute2 have them)'
    tried = subprocess.run(
        ['unshare', '--net', '--mount', 'true'], capture_output=True, text=True, check=False
    )
    return '' if tried.returncode == 0 else f'{tried.stderr.strip()} (needs root)'


def run_on_hosts(case: str, folder: Path, report: Callable[[str], None]) -> FaultOutcome:
    """Run one of `CASES` on its own host and return its outcome.

    `report` receives the lines that the host prints. Raises OSError when the host fails.
    """
    folder.mkdir(parents=True)
    host = subprocess.Popen(host_command(case, folder), stdout=subprocess.PIPE, text=True)
    assert host.stdout is not None
    try:
        for line in host.stdout:
            report(line.rstrip())
        host.wait()
    finally:
        host.send_signal(signal.SIGTERM)
    if not (folder / _RESULT).exists():
        raise OSError(f'{case}: the host ended with exit code {host.returncode}, logs in {folder}')
    return read_outcome(folder)


def host_command(case: str, folder: Path) -> list[str]:
    """Return the command line that runs a case in namespaces of its own."""
    command = module_command('ja_diagnostics.faults.hosts', case, str(folder))
    return ['unshare', '--net', '--mount', *command]


def write_outcome(outcome: FaultOutcome, folder: Path) -> None:
    """Write an outcome into a folder, for `read_outcome`."""
    (folder / _RESULT).write_text(json.dumps(asdict(outcome)))


def read_outcome(folder: Path) -> FaultOutcome:
    """Read the outcome that a host has written into a folder."""
    values = json.loads((folder / _RESULT).read_text())
    return FaultOutcome(**{**values, 'lost': tuple(values['lost'])})


def place_on_host(graph: Sequence[NodeSpec], executable: str, host: int) -> list[NodeSpec]:
    """Return the graph with one node on another host, which a process id identifies."""
    return [
        _FarNode(**{**vars(spec), 'host': host}) if spec.executable == executable else spec
        for spec in graph
    ]


def _network_cut(folder: Path) -> FaultOutcome:
    with far_host() as host:
        # This is safe: no link leads out of these two hosts.
        set_discovery_range('SUBNET')

        def place(graph: list[NodeSpec]) -> list[NodeSpec]:
            return place_on_host(graph, 'learning_module', host)

        run = FaultRun(folder, _report, place)
        cut = Fault(
            'network to the learner cut',
            lambda _: _ip('link set near down'),
            lambda _: _ip('link set near up'),
        )
        return _run_fault(run, cut)


def _intruder(folder: Path) -> FaultOutcome:
    with far_host() as host:
        set_discovery_range('LOCALHOST')
        tries: list[subprocess.Popen[str]] = []

        def end(_: Graph) -> None:
            found, _error = tries[0].communicate()
            _report(f'the other host found: {found.strip()}')

        fault = Fault(
            'another host calls enable(false)',
            lambda _: tries.append(start_intruder(host)),
            end,
            _INTRUDER_S,
            stops=False,
        )
        return _run_fault(FaultRun(folder, _report), fault)


def _full_of_dead_segments(folder: Path) -> FaultOutcome:
    subprocess.run(['mount', '-o', f'remount,size={_FULL_BYTES}', '/dev/shm'], check=True)
    while shutil.disk_usage('/dev/shm').free > _SEGMENT_BYTES:
        subprocess.run(code_command(_DIES), check=False)
    run = FaultRun(folder, _report)
    (killed,) = [f for f in run.faults() if f.name == 'salient_feature_detector killed -9']
    return _run_fault(run, replace(killed, name=f'{killed.name}, /dev/shm full of dead segments'))


CASES = {'network': _network_cut, 'intruder': _intruder, 'segments': _full_of_dead_segments}


def start_intruder(host: int, for_s: float = _INTRUDER_S) -> subprocess.Popen[str]:
    """Start a program on the far host that names the near one and calls its `gate/enable` (false).

    It prints one line of JSON after `for_s` [s], with the keys of `intruder.try_to_enter`.
    """
    environ = {
        **os.environ,
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
        'ROS_STATIC_PEERS': _NEAR_ADDRESS.partition('/')[0],
    }
    program = module_command(intruder.__name__, str(for_s))
    command = ['nsenter', f'--target={host}', '--net', '--mount', '--', *program]
    return subprocess.Popen(command, env=environ, stdout=subprocess.PIPE, text=True)


def set_discovery_range(name: str) -> None:
    """Set the discovery range of this process and its children, whatever the caller has set."""
    for other in ('ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS'):
        os.environ.pop(other, None)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = name
    apply_ros_defaults()


def _run_fault(run: FaultRun, fault: Fault) -> FaultOutcome:
    run.run([fault])
    return run.outcomes[0]


@contextmanager
def far_host(connect: Callable[[int], None] | None = None) -> Iterator[int]:
    """Make a second host at the end of a virtual cable; yield the process id of its namespaces.

    `connect` is called with that id, and puts the device `far` there, and `near` here; by default
    they are a pair that neither delays nor loses anything.
    """
    # It waits for the end of its input, so that it ends with this process.
    script = 'mount -t tmpfs tmpfs /dev/shm && ip link set lo up && echo ready && cat'
    far = subprocess.Popen(
        ['unshare', '--net', '--mount', 'sh', '-c', script],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    assert far.stdout is not None
    try:
        far.stdout.readline()
        (connect or _make_pair)(far.pid)
        _ip(f'address add {_NEAR_ADDRESS} dev near')
        _ip('link set near up')
        enter = ['nsenter', f'--target={far.pid}', '--net']
        for order in (f'address add {_FAR_ADDRESS} dev far', 'link set far up'):
            subprocess.run([*enter, 'ip', *order.split()], check=True)
        # Fast DDS looks once for interfaces, and takes only those whose cable is plugged in.
        _wait_until_plugged_in('near')
        _wait_until_plugged_in('far', enter)
        yield far.pid
    finally:
        far.communicate()


def move_far_end(host: int) -> None:
    """Move the end `far` of a cable (`cable.lay_cable`) to a host."""
    _ip(f'link set {FAR} netns {host}')


def _make_pair(host: int) -> None:
    _ip(f'link add {NEAR} type veth peer name {FAR} netns {host}')


def _wait_until_plugged_in(device: str, enter: Sequence[str] = ()) -> None:
    command = [*enter, 'ip', '-oneline', 'link', 'show', device]
    end_s = time.monotonic() + _PLUG_PATIENCE_S
    while True:
        shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        # A TAP device does not know its state; its carrier is there once its program runs.
        if 'LOWER_UP' in shown and (' state UP ' in shown or ' state UNKNOWN ' in shown):
            return
        if time.monotonic() > end_s:
            raise OSError(f'the virtual network device {device} did not come up')
        time.sleep(0.02)


def _ip(order: str) -> None:
    subprocess.run(['ip', *order.split()], check=True)


def _report(line: str) -> None:
    print(line, flush=True)


def prepare_host() -> None:
    """Give the near host, whose namespaces exist already and are empty, what every host has."""
    subprocess.run(['mount', '-t', 'tmpfs', 'tmpfs', '/dev/shm'], check=True)
    _ip('link set lo up')


def main() -> None:
    """Run a case inside the near host."""
    case, folder = sys.argv[1], Path(sys.argv[2])
    prepare_host()
    apply_ros_defaults()
    outcome = CASES[case](folder)
    write_outcome(outcome, folder)


if __name__ == '__main__':
    main()
