"""All faults: how each begins and ends, how long it lasts, and whether the head has to stop."""

import os
import resource
import signal
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ja_common.topics import CAMERA_INFO, IMAGE, JOINT_STATES, Topic
from ja_diagnostics.faults.disturbance import Disturbance
from ja_diagnostics.faults.page_attack import PageAttack
from ja_diagnostics.faults.relay import Relay

LASTS_S = 5.0
HUNG_AFTER_S = 8.0
"""A node without a heartbeat for so long is replaced: longer than any other fault lasts."""

_CAMERA = (IMAGE, CAMERA_INFO)
_JOINTS = (JOINT_STATES,)
_silence = partial(Disturbance, silent=True)
_delay = partial(Disturbance, delay_s=0.1)
_disorder = partial(Disturbance, swapped=True)


@dataclass(frozen=True)
class Graph:
    """What a fault acts on: the process of each node, and the relay behind the head."""

    pids: Callable[[], Mapping[str, int]]
    relay: Relay

    def send_signal(self, node: str, number: int) -> None:
        """Send a signal to a node's process."""
        os.kill(self.pids()[node], number)


Action = Callable[[Graph], None]


def _at_its_time(_: Graph) -> bool:
    return False


def _yes() -> bool:
    return True


@dataclass(frozen=True)
class Fault:
    """A fault. `stops`: does the head have to stop? If not, it has to go on.

    It ends after `lasts_s`, or earlier when it is `over`. `withstood` is asked at its end: what
    else has to hold?
    """

    name: str
    begin: Action
    end: Action
    lasts_s: float = LASTS_S
    stops: bool = True
    over: Callable[[Graph], bool] = _at_its_time
    withstood: Callable[[], bool] = _yes


def faults(nodes: list[str], page_log: Path) -> list[Fault]:
    """Return all faults of a graph with these nodes, each in its own process.

    `page_log`: the log of the live page, which runs beside them.
    """
    return [
        *(fault for node in nodes for fault in (_killed(node), _frozen(node), _hung(node))),
        _disturbed('camera stopped', _CAMERA, _silence),
        _disturbed('joint states stopped', _JOINTS, _silence),
        _disturbed('joint states delayed by 0.1 s', _JOINTS, _delay, stops=False),
        _disturbed('joint states out of order', _JOINTS, _disorder, stops=False),
        _clock_set_back(),
        _disk_full(),
        _two_commanders(),
        _page_attacked(page_log),
    ]


def _killed(node: str) -> Fault:
    # The supervisor restarts the node at once; no Python is running again before 0.5 s.
    return Fault(
        f'{node} killed -9', lambda graph: graph.send_signal(node, signal.SIGKILL), _nothing, 0.5
    )


def _frozen(node: str) -> Fault:
    return Fault(
        f'{node} frozen',
        lambda graph: graph.send_signal(node, signal.SIGSTOP),
        lambda graph: graph.send_signal(node, signal.SIGCONT),
    )


def _hung(node: str) -> Fault:
    """Freeze a node for ever: the supervisor has to notice, and to replace it."""
    frozen: list[int] = []

    def begin(graph: Graph) -> None:
        frozen.append(graph.pids()[node])
        graph.send_signal(node, signal.SIGSTOP)

    def is_replaced(graph: Graph) -> bool:
        return graph.pids()[node] != frozen[0]

    longest_s = 3 * HUNG_AFTER_S
    return Fault(f'{node} hung, replaced', begin, _nothing, longest_s, over=is_replaced)


def _disk_full() -> Fault:
    """Let no node write to a file: as on a full disk, only that the error has another name."""

    def limit_writing(size: int, graph: Graph) -> None:
        for pid in graph.pids().values():
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    return Fault(
        'disk full',
        partial(limit_writing, 0),
        partial(limit_writing, resource.RLIM_INFINITY),
        stops=False,
    )


def _two_commanders() -> Fault:
    return Fault(
        'two commanders of the head',
        lambda graph: graph.relay.start_commanding(),
        lambda graph: graph.relay.stop_commanding(),
    )


def _page_attacked(log: Path) -> Fault:
    attack = PageAttack(log)
    return Fault(
        'page opened by another site, joint states of wheels',
        lambda graph: attack.begin(graph.relay),
        _nothing,
        stops=False,
        withstood=attack.is_withstood,
    )


def _disturbed(
    name: str, topics: Sequence[Topic], make: Callable[[], Disturbance], stops: bool = True
) -> Fault:
    return Fault(
        name,
        lambda graph: graph.relay.disturb(topics, make),
        lambda graph: graph.relay.disturb(topics, Disturbance),
        stops=stops,
    )


def _clock_set_back() -> Fault:
    def begin(graph: Graph) -> None:
        graph.relay.clock_ahead_s -= 3.0

    return Fault('clock set back by 3 s', begin, _nothing, 2.0, stops=False)


def _nothing(_: Graph) -> None:
    pass
