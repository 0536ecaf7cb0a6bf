"""Real-time priority: of a process of its own, as it changes all threads there are."""

import json
import os
import subprocess
import sys

import pytest

PROGRAM = """
import json, os
from concurrent.futures import ThreadPoolExecutor
from ja_common.realtime import use_default_scheduling, go_back_among_all, enable_realtime_scheduling

def policy():
    return os.sched_getscheduler(0), os.sched_getparam(0).sched_priority

old = ThreadPoolExecutor(1)
old.submit(policy).result()
try:
    enable_realtime_scheduling(7)
except PermissionError as error:
    print(json.dumps(str(error)))
else:
    urgent, calm = ThreadPoolExecutor(1), ThreadPoolExecutor(1, initializer=use_default_scheduling)
    pools = old, urgent, calm
    said = [policy(), *(pool.submit(policy).result() for pool in pools)]
    go_back_among_all()
    print(json.dumps([said, [policy(), *(pool.submit(policy).result() for pool in pools)]]))
"""


def test_all_threads_go_before_all_else_but_who_wants_to_be_as_any_program():
    ran = subprocess.run(
        [sys.executable, '-c', PROGRAM], capture_output=True, text=True, timeout=60, check=True
    )
    said = json.loads(ran.stdout)
    if isinstance(said, str):
        assert said.startswith('real-time priority 7 is not allowed to this user: be root')
        pytest.skip('this user may not')
    urgent, calm = [os.SCHED_RR, 7], [os.SCHED_OTHER, 0]
    assert said[0] == [urgent, urgent, urgent, calm]
    assert said[1] == [calm] * 4
