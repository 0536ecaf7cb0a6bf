"""Real-time priority, in a process of its own, because it changes all threads."""

import json
import os
import subprocess
import sys

import pytest

from ros_testing import PATIENCE_S

PROGRAM = """
import json, os
from concurrent.futures import ThreadPoolExecutor
from ja_common import realtime

def policy():
    return os.sched_getscheduler(0), os.sched_getparam(0).sched_priority

old = ThreadPoolExecutor(1)
old.submit(policy).result()
try:
    realtime.enable_realtime_scheduling(7)
except PermissionError as error:
    print(json.dumps(str(error)))
else:
    urgent = ThreadPoolExecutor(1)
    calm = ThreadPoolExecutor(1, initializer=realtime.use_default_scheduling)
    pools = old, urgent, calm
    before = [policy(), *(pool.submit(policy).result() for pool in pools)]
    realtime.restore_scheduling()
    print(json.dumps([before, [policy(), *(pool.submit(policy).result() for pool in pools)]]))
"""


def test_all_threads_are_real_time_but_those_that_use_default_scheduling():
    ran = subprocess.run(
        [sys.executable, '-c', PROGRAM],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    )
    result = json.loads(ran.stdout)
    if isinstance(result, str):
        assert result.startswith('real-time priority 7 is not allowed to this user: be root')
        pytest.skip('this user may not')
    urgent, calm = [os.SCHED_RR, 7], [os.SCHED_OTHER, 0]
    assert result[0] == [urgent, urgent, urgent, calm]
    assert result[1] == [calm] * 4
