"""In the default range a node receives from this machine alone, whatever becomes of /dev/shm."""

import os
import re
import socket
import subprocess
import sys
import time
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

from ja_common.private_context import private_executor
from mounts import needs_mounts, with_shared_memory
from ros_testing import spin_until

NODE = """
import sys
from ja_common.ros_defaults import apply_ros_defaults
apply_ros_defaults()
import rclpy
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image
rclpy.init()
node = rclpy.create_node('other')
publisher = node.create_publisher(Image, 'sent', qos_profile_sensor_data)
def send_back(message):
    publisher.publish(message)
node.create_subscription(Image, 'image', send_back, qos_profile_sensor_data)
print('ready', flush=True)
rclpy.spin(node)
"""


@dataclass(frozen=True)
class Bound:
    """A UDP socket: where it is bound, and how many bytes wait in it."""

    address: str
    port: int
    waiting: int


@contextmanager
def running(command: list[str], **environ: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a node's process until the block ends; begin when it prints that it is ready."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, **environ})
    try:
        # Fast DDS writes there, too: of a /dev/shm that it cannot use.
        assert b'ready\n' in process.stdout
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def udp_sockets(pid: int) -> list[Bound]:
    """Return the UDP sockets of a process."""
    inodes = set()
    for entry in Path(f'/proc/{pid}/fd').iterdir():
        if found := re.fullmatch(r'socket:\[(\d+)\]', os.readlink(entry)):
            inodes.add(found[1])
    sockets = []
    for table, family in (('udp', socket.AF_INET), ('udp6', socket.AF_INET6)):
        for line in Path(f'/proc/{pid}/net/{table}').read_text().splitlines()[1:]:
            fields = line.split()
            if fields[9] in inodes:
                address, port = fields[1].split(':')
                words = [
                    bytes.fromhex(address[i : i + 8])[::-1] for i in range(0, len(address), 8)
                ]
                name = socket.inet_ntop(family, b''.join(words))
                sockets.append(Bound(name, int(port, 16), int(fields[4].split(':')[1], 16)))
    return sockets


def reads(pid: int, bound: Bound, datagrams: int = 3) -> bool:
    """Send to a socket; return True if the process takes what has come."""
    to = '127.0.0.1' if bound.address == '0.0.0.0' else bound.address
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(datagrams):
            sender.sendto(b'no message of DDS', (to, bound.port))
    end_s = time.monotonic() + 1.0
    while time.monotonic() < end_s:
        if not any(
            (each.address, each.port) == (bound.address, bound.port) and each.waiting
            for each in udp_sockets(pid)
        ):
            return True
        time.sleep(0.02)
    return False


@pytest.mark.usefixtures('domain')
def test_a_node_reads_from_sockets_of_this_machine_alone():
    with running([sys.executable, '-c', NODE]) as process:
        sockets = udp_sockets(process.pid)
        local = [each for each in sockets if each.address == '127.0.0.1']
        # Of Fast DDS's own, which sends only: rmw_fastrtps adds it, and nothing reads from it.
        others = [each for each in sockets if each not in local]
        assert any(reads(process.pid, each) for each in local)
        assert not [each for each in others if reads(process.pid, each)]


def test_a_node_does_not_join_the_multicast_of_discovery(domain):
    with running([sys.executable, '-c', NODE]) as process:
        ports = {each.port for each in udp_sockets(process.pid)}
        assert 7400 + 250 * domain not in ports  # RTPS's port of this domain


@needs_mounts
@pytest.mark.usefixtures('domain')
@pytest.mark.parametrize(('options', 'free_pages'), [('ro', None), ('size=1m', 12)])
def test_images_go_to_and_fro_where_shared_memory_cannot_be_used(options, free_pages):
    command = with_shared_memory(options, [sys.executable, '-c', NODE], free_pages)
    image = Image(height=240, width=320, step=960)
    image.data = array('B', bytes(range(240)) * 960)
    received: list[Image] = []
    with running(command), private_executor() as executor:
        node = Node('here', context=executor.context)
        executor.add_node(node)
        publisher = node.create_publisher(Image, 'image', qos_profile_sensor_data)
        node.create_subscription(Image, 'sent', received.append, qos_profile_sensor_data)
        node.create_timer(0.1, lambda: publisher.publish(image))
        spin_until(executor, lambda: received)
    assert received[0].data == image.data
