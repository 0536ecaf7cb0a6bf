"""Fixtures of the node tests: a ROS domain of its own, a private context."""

import os
import random
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest
from rclpy.context import Context

from ja_common.private_context import private_context
from ja_common.ros_defaults import apply_ros_defaults
from node_bench import NodeBench

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
apply_ros_defaults()

# Not the first ids, which people use by hand; above 101 the ports of DDS leave the safe range.
DOMAINS = range(50, 102)
_LOCK_PORT = 32768


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Choose a ROS_DOMAIN_ID that no other test of this machine uses, also in os.environ.

    It is held by a listening socket, which the system releases however the test ends. A fresh
    one for each test: no test hears what another left behind.
    """
    for candidate in random.Random().sample(DOMAINS, len(DOMAINS)):
        with socket.socket() as lock:
            try:
                lock.bind(('127.0.0.1', _LOCK_PORT + candidate))
            except OSError:
                continue
            monkeypatch.setenv('ROS_DOMAIN_ID', str(candidate))
            yield candidate
            return
    raise RuntimeError(f'no free ROS_DOMAIN_ID among {DOMAINS}')


@pytest.fixture
def ros_context(domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Context]:
    """Initialise an rclpy Context of this test alone, in the test's own domain and folder."""
    # What a rig has learned in runs/, here where the tests are run, is not for them.
    monkeypatch.chdir(tmp_path)
    with private_context(domain_id=domain) as context:
        yield context


@pytest.fixture
def make_bench(ros_context: Context) -> Iterator[Callable[..., NodeBench]]:
    """Return a maker of NodeBenches in the test's own domain; each is closed at the end."""
    with ExitStack() as benches:
        yield lambda *args, **kwargs: benches.enter_context(
            closing(NodeBench(ros_context, *args, **kwargs))
        )
