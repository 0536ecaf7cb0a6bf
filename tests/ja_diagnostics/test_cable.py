"""The cable that delays and loses frames: its ways alone, and between two real hosts."""

import json
import os
import random
import subprocess
import sys

import pytest

from ja_diagnostics.faults import hosts
from ja_diagnostics.faults.cable import TUN, Direction, Impairment
from ros_testing import PATIENCE_S

FRAMES = [bytes([number]) for number in range(200)]
WHY_NOT = hosts.missing() or ('' if TUN.exists() else f'no {TUN}')

NEAR = """
import itertools, json, socket, subprocess, sys, time
from ja_diagnostics.faults import hosts
from ja_diagnostics.faults.cable import Impairment, lay_cable

ECHO = '''
import socket
echo = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
echo.bind((\"10.77.0.2\", 7000))
print(\"ready\", flush=True)
while True:
    data, sender = echo.recvfrom(100)
    echo.sendto(data, sender)
'''

numbers = itertools.count()

def round_trips(count):
    found = []
    for _ in range(count):
        sent_s = time.monotonic()
        number = str(next(numbers)).encode()  # never one that may still be under way
        near.sendto(number, ('10.77.0.2', 7000))
        try:
            while near.recv(100) != number:
                pass
            found.append(time.monotonic() - sent_s)
        except TimeoutError:
            pass
    return found

delay_s, loss = float(sys.argv[1]), float(sys.argv[2])
hosts.prepare_host()
with lay_cable(Impairment(delay_s, loss)) as cable, hosts.far_host(hosts.move_far_end) as host:
    command = ['nsenter', f'--target={host}', '--net', '--', sys.executable, '-c', ECHO]
    echo = subprocess.Popen(command, stdout=subprocess.PIPE)
    echo.stdout.readline()
    near = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    near.settimeout(0.5)
    while not round_trips(1):  # the first one also asks for the address of the device
        pass
    whole = round_trips(30)
    cable.cut()
    cut = round_trips(2)
    cable.join()
    while not round_trips(1):
        pass
    echo.kill()
    echo.wait()
    print(json.dumps([whole, cut]))
"""


def come_out(way: Direction) -> list[bytes]:
    """Return which frames come out at the end."""
    for frame in FRAMES:
        way.queue_frame(frame, 0.0)
    return list(way.pop_due(1e9))


def test_frames_come_out_later_and_in_their_order():
    way = Direction(Impairment(0.02), random.Random(0))
    assert way.next_due_s is None
    for number, frame in enumerate(FRAMES[:3]):
        way.queue_frame(frame, 0.001 * number)
    assert way.next_due_s == pytest.approx(0.02)
    assert list(way.pop_due(0.0199)) == []
    assert list(way.pop_due(0.0211)) == FRAMES[:2]
    assert list(way.pop_due(1.0)) == FRAMES[2:3]


def test_a_seed_loses_the_same_share_of_frames_each_time():
    first, again, other = (
        come_out(Direction(Impairment(loss=0.2), random.Random(seed))) for seed in (1, 1, 2)
    )
    assert first == again != other
    assert 0.7 < len(first) / len(FRAMES) < 0.9
    assert come_out(Direction(Impairment(), random.Random(0))) == FRAMES


def test_a_cut_cable_carries_nothing():
    way = Direction(Impairment(), random.Random(0))
    way.is_cut = True
    assert come_out(way) == []
    way.is_cut = False
    assert come_out(way) == FRAMES


@pytest.mark.skipif(WHY_NOT != '', reason=WHY_NOT)
@pytest.mark.parametrize(('delay_s', 'loss'), [(0.0, 0.0), (0.02, 0.3)])
def test_between_two_hosts_the_cable_delays_and_loses(delay_s, loss):
    command = ['unshare', '--net', '--mount', sys.executable, '-c', NEAR, str(delay_s), str(loss)]
    ran = subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=PATIENCE_S, env=os.environ
    )
    whole, cut = json.loads(ran.stdout)
    assert cut == []
    assert all(each >= 2 * delay_s for each in whole)
    # Both ways lose: 30 answers without loss, and about half of them with this one.
    assert len(whole) == 30 if loss == 0.0 else 5 <= len(whole) <= 25
