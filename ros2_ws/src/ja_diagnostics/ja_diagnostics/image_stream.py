"""A publisher and a receiver of images, each its own process; they print figures as JSON.

`python -m ja_diagnostics.image_stream publish_images` (or `receive_images`).
"""

import json
import sys
import time
from collections.abc import Callable

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import Image

from ja_common.image_codec import encode_image
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import IMAGE

IMAGES = 240
RATE_HZ = 60.0
SHAPE = (480, 640, 3)
_PATIENCE_S = 30.0
# The words of the command line.
PUBLISH, RECEIVE = 'publish_images', 'receive_images'


def publish_images() -> dict[str, float]:
    """Wait for the receiver, then send it images; return the seconds until it was found."""
    node, executor = _node('image_publisher')
    publisher = node.create_publisher(IMAGE.type, IMAGE.name, IMAGE.publisher_qos)
    began_s = time.monotonic()
    _spin_until(executor, lambda: publisher.get_subscription_count() > 0)
    discovery_s = time.monotonic() - began_s
    picture = np.random.default_rng(0).integers(0, 256, SHAPE, np.uint8)
    for number in range(IMAGES):
        due_s = began_s + discovery_s + 0.5 + number / RATE_HZ
        time.sleep(max(0.0, due_s - time.monotonic()))
        # The monotonic clock is one for all processes of a machine.
        publisher.publish(encode_image(picture, to_time(time.monotonic_ns()), ''))
    return {'discovery_s': discovery_s}


def receive_images() -> dict[str, list[float]]:
    """Return the delays [ms] of the images that arrive, until none has come for a second."""
    node, executor = _node('image_receiver')
    delays_ms: list[float] = []

    def on_image(message: Image) -> None:
        delays_ms.append(1e-6 * (time.monotonic_ns() - to_ns(message.header.stamp)))

    node.create_subscription(IMAGE.type, IMAGE.name, on_image, IMAGE.subscriber_qos)
    print('subscribed', file=sys.stderr, flush=True)
    _spin_until(executor, lambda: delays_ms)
    count, since_s = 0, time.monotonic()
    while time.monotonic() - since_s < 1.0:
        executor.spin_once(timeout_sec=0.1)
        if len(delays_ms) > count:
            count, since_s = len(delays_ms), time.monotonic()
    return {'delays_ms': delays_ms}


def _node(name: str) -> tuple[Node, SingleThreadedExecutor]:
    rclpy.init()
    node = Node(name)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    return node, executor


def _spin_until(executor: SingleThreadedExecutor, condition: Callable[[], object]) -> None:
    end_s = time.monotonic() + _PATIENCE_S
    while not condition():
        if time.monotonic() > end_s:
            sys.exit(f'the other process did not appear within {_PATIENCE_S:g} s')
        executor.spin_once(timeout_sec=0.001)


if __name__ == '__main__':
    print(json.dumps({PUBLISH: publish_images, RECEIVE: receive_images}[sys.argv[1]]()))
    rclpy.shutdown()
