"""Refuse a domain in which nodes of the same names run already: both graphs would act as one.

Two learners would learn from one head, and two gates would command it. The names are held in two
ways. A graph that `./ja` runs on this machine claims its names with sockets, which cannot be
missed, and which the system releases however the process ends. All other nodes, those started by
hand and those of other machines, are looked up in the ROS graph.
"""

import errno
import hashlib
import os
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager

import rclpy
from rclpy.context import Context

from ja_common.core.config import ConfigError
from ja_common.private_context import private_context
from ja_common.ros_arguments import domain_id
from ja_common.ros_defaults import LEASE_S, reaches_network
from ja_runner.node_spec import NodeSpec

_DISCOVERY_S = 1.5
"""Other nodes of this machine were discovered within 0.6 s; a busy machine takes longer."""
# The nodes of a process that was killed are listed until their lease ends.
_KILLED_IS_LISTED_S = LEASE_S + 1.0
_POLL_S = 0.02
_MOST_NAMED = 3
# RTPS 2.5, 9.6.2.3: the port at which participant i of a domain is discovered by unicast.
_FIRST_PORT, _PORTS_PER_DOMAIN, _PORTS_PER_PARTICIPANT, _PARTICIPANTS = 7410, 250, 2, 32


@contextmanager
def claim_names(graph: Sequence[NodeSpec]) -> Iterator[None]:
    """Claim the names of a graph's nodes, namespaces and remaps included, while it runs.

    Raises ConfigError if nodes of these names run in this ROS domain, with what to do. It takes
    some milliseconds if nothing runs in the domain, and up to `_DISCOVERY_S` otherwise.
    """
    domain, names = domain_id(), full_names(graph)
    with ExitStack() as claims:
        taken = [name for name in names if not _claim(name, domain, claims)]
        if taken := taken or _running(names, domain):
            more = len(taken) - _MOST_NAMED
            which = ', '.join(taken[:_MOST_NAMED]) + (f' and {more} more' if more > 0 else '')
            raise ConfigError(
                f'in ROS_DOMAIN_ID {domain} there is already {which}: end that graph first, '
                'set another ROS_DOMAIN_ID, or add a namespace: --ros-args -r __ns:=/NAME'
            )
        yield


def full_names(graph: Sequence[NodeSpec]) -> list[str]:
    """Return the names of a graph's nodes, namespaces and remaps included, sorted."""
    with private_context(discovery=False) as context:
        return sorted({_full_name(spec, context) for spec in graph})


def _full_name(spec: NodeSpec, context: Context) -> str:
    """Return the name of a node with its namespace, as rcl makes it of the node's arguments."""
    arguments = spec.ros_arguments()
    if not any(rule in each for each in arguments for rule in ('__ns', '__node', '__name')):
        return f'/{spec.executable}'
    node = rclpy.create_node(
        spec.executable,
        context=context,
        cli_args=arguments,
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
    )
    try:
        return node.get_fully_qualified_name()
    finally:
        node.destroy_node()


def _claim(name: str, domain: int, claims: ExitStack) -> bool:
    """Bind a socket that stands for the node's name on this machine; False: another has it."""
    claim = claims.enter_context(socket.socket(socket.AF_UNIX))
    digest = hashlib.sha256(f'{domain}{name}'.encode()).hexdigest()
    try:
        claim.bind(f'\0joint-attention-{digest}')  # no file: the name ends with the process
    except OSError as error:
        if error.errno != errno.EADDRINUSE:
            raise
        return False
    return True


def _running(names: Sequence[str], domain: int) -> list[str]:
    """Return those of the names that nodes of the ROS graph have, and keep."""
    if not (reaches_network() or _has_participants(domain)):
        return []
    with private_context(discovery=True) as context:
        probe = rclpy.create_node(
            f'names_{os.getpid()}',
            context=context,
            enable_rosout=False,
            start_parameter_services=False,
        )

        def found() -> list[str]:
            listed = probe.get_node_names_and_namespaces()
            present = {f'{namespace.rstrip("/")}/{node}' for node, namespace in listed}
            return [name for name in names if name in present]

        try:
            if not _wait(found, _DISCOVERY_S) or _wait(lambda: not found(), _KILLED_IS_LISTED_S):
                return []
            return found()
        finally:
            probe.destroy_node()


def _has_participants(domain: int) -> bool:
    """Return whether a process of this machine may take part in the domain."""
    first = _FIRST_PORT + _PORTS_PER_DOMAIN * domain
    for port in range(first, first + _PARTICIPANTS * _PORTS_PER_PARTICIPANT, 2):
        with socket.socket(type=socket.SOCK_DGRAM) as own:
            try:
                own.bind(('127.0.0.1', port))
            except OSError:
                return True
    return False


def _wait(condition: Callable[[], object], within_s: float) -> bool:
    """Return whether a condition holds within so many seconds."""
    end_s = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(_POLL_S)
    return True
