"""Waiting for a condition in node tests, instead of sleeping for a fixed time."""

import time
from collections.abc import Callable

from rclpy.executors import Executor

PATIENCE_S = 300.0
"""So long a test waits for what has to happen: on a busy machine a graph starts in minutes."""


def spin_until(
    executor: Executor, condition: Callable[[], object], timeout_s: float = PATIENCE_S
) -> None:
    """Spin until the condition holds; AssertionError when it does not within `timeout_s` [s]."""
    end = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f'condition not met within {timeout_s:g} s')
        executor.spin_once(timeout_sec=0.05)


def wait_for(condition: Callable[[], object]) -> None:
    """Sleep until the condition holds; AssertionError when it does not within PATIENCE_S."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, 'condition not met in time'
        time.sleep(0.005)
