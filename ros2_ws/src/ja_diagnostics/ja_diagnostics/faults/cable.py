"""`python -m ja_diagnostics.faults.cable DELAY_S LOSS SEED`: a cable that delays and loses.

It joins two virtual network devices of Linux (TAP), so that it needs no module of the kernel as
`tc netem` does. A line `cut` on its input makes it lose every frame, `join` ends that; it ends
with its input. Root only.
"""

import contextlib
import fcntl
import os
import random
import select
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from ja_common.python_command import module_command
from ja_diagnostics.faults.disturbance import Disturbance

TUN = Path('/dev/net/tun')
NEAR, FAR = 'near', 'far'
"""The names of the two devices."""

_READY = 'ready'
# From linux/if_tun.h: a device of Ethernet frames, which are read and written as they are.
_TUNSETIFF, _IFF_TAP, _IFF_NO_PI = 0x400454CA, 0x0002, 0x1000
_FRAME_BYTES = 65536
_IDLE_S = 1.0


@dataclass(frozen=True)
class Impairment:
    """What a cable does: delay [s] of each frame on its one way, and the share that it loses."""

    delay_s: float = 0.0
    loss: float = 0.0
    seed: int = 0


@dataclass
class Direction:
    """The frames on their way from one end to the other."""

    impairment: Impairment
    random: random.Random
    is_cut: bool = False
    _waiting: Disturbance = field(init=False)

    def __post_init__(self) -> None:
        self._waiting = Disturbance(delay_s=self.impairment.delay_s)

    def queue_frame(self, frame: bytes, now_s: float) -> None:
        """Take a frame at one end, at a steady time [s]; it may be lost."""
        if self.random.random() >= self.impairment.loss and not self.is_cut:
            self._waiting.queue_message(frame, now_s)

    def pop_due(self, now_s: float) -> Iterator[bytes]:
        """Yield the frames that come out at the other end now, in their order."""
        return self._waiting.pop_due(now_s)

    @property
    def next_due_s(self) -> float | None:
        """Return when the next frame comes out [s]; None while there is none."""
        return self._waiting.next_due_s


class Cable:
    """A cable that runs as a process of its own; `cut` and `join` work at once."""

    def __init__(self, commands: IO[str]) -> None:
        self._commands = commands

    def cut(self) -> None:
        """Lose every frame from now on."""
        self._command('cut')

    def join(self) -> None:
        """Carry frames again."""
        self._command('join')

    def _command(self, text: str) -> None:
        self._commands.write(f'{text}\n')
        self._commands.flush()


@contextlib.contextmanager
def lay_cable(impairment: Impairment) -> Iterator[Cable]:
    """Make the devices `NEAR` and `FAR` in these namespaces, and carry frames between them.

    Either may then be moved into another network namespace. Raises OSError where the kernel has
    no TAP devices.
    """
    values = (impairment.delay_s, impairment.loss, impairment.seed)
    command = module_command('ja_diagnostics.faults.cable', *map(str, values))
    relay = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert relay.stdin is not None
    assert relay.stdout is not None
    try:
        if relay.stdout.readline().strip() != _READY:
            raise OSError(f'the virtual cable cannot be made with {TUN}')
        yield Cable(relay.stdin)
    finally:
        relay.stdin.close()
        relay.wait()
        relay.stdout.close()


def open_device(name: str) -> int:
    """Make a TAP device and return its file descriptor. Raises OSError without the right to."""
    descriptor = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
    request = struct.pack('16sH22x', name.encode(), _IFF_TAP | _IFF_NO_PI)
    fcntl.ioctl(descriptor, _TUNSETIFF, request)
    return descriptor


def carry_frames(near: int, far: int, impairment: Impairment, commands: int) -> None:
    """Carry frames between two devices until the descriptor of the commands is at its end."""
    source = random.Random(impairment.seed)
    ways = {near: (Direction(impairment, source), far), far: (Direction(impairment, source), near)}
    poll = select.poll()
    for descriptor in (near, far, commands):
        poll.register(descriptor, select.POLLIN)
    while True:
        for descriptor, _ in poll.poll(_patience_ms([way for way, _ in ways.values()])):
            if descriptor == commands:
                text = os.read(commands, 1024).decode()
                if not text:
                    return
                for way, _ in ways.values():
                    way.is_cut = text.split()[-1] == 'cut'
            else:
                _read_frames(descriptor, ways[descriptor][0])
        for way, end in ways.values():
            for frame in way.pop_due(time.monotonic()):
                _write_frame(end, frame)


def _patience_ms(ways: list[Direction]) -> float:
    due_s = [way.next_due_s for way in ways if way.next_due_s is not None]
    wait_s = min(due_s) - time.monotonic() if due_s else _IDLE_S
    return max(wait_s, 0.0) * 1e3


def _read_frames(descriptor: int, way: Direction) -> None:
    while True:
        try:
            frame = os.read(descriptor, _FRAME_BYTES)
        except OSError:  # no more, or the device is down
            return
        way.queue_frame(frame, time.monotonic())


def _write_frame(descriptor: int, frame: bytes) -> None:
    # The device is down, or its queue is full: a frame is lost, as on a cable.
    with contextlib.suppress(OSError):
        os.write(descriptor, frame)


def main() -> None:
    """Join the two devices."""
    delay_s, loss, seed = sys.argv[1:]
    near, far = open_device(NEAR), open_device(FAR)
    print(_READY, flush=True)
    impairment = Impairment(float(delay_s), float(loss), int(seed))
    carry_frames(near, far, impairment, sys.stdin.fileno())


if __name__ == '__main__':
    main()
