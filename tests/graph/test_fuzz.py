"""Malformed messages on every topic of a node, and odd requests: no node dies."""

import array
import random
import resource

import pytest
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from std_srvs.srv import SetBool

from ja_common.executor import CachedWaitSetExecutor
from ja_runner.graph import rig_graph, sim_graph
from ros_testing import spin_until

SPECS = {
    spec.executable: spec
    for spec in [*sim_graph(), *rig_graph('unused')]
    if spec.executable not in ('camera', 'sim')
}
NUMBERS = (0, 1, -1, 2**31 - 1, -(2**31), float('nan'), float('inf'), 1e30)
BOUNDS = {
    f'{sign}int{bits}': (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for bits in (8, 16, 32, 64)
    for sign in ('', 'u')
}
TEXTS = ('', 'pan', '\x01\x7f', '../../etc/passwd', '$(reboot)', 'ü' * 3000)


def spoiled(message, rng):
    """Fill fields of a message with odd values: sizes, numbers, strings."""
    for name, kind in message.get_fields_and_field_types().items():
        if rng.random() < 0.4:
            continue
        value = getattr(message, name)
        if hasattr(value, 'get_fields_and_field_types'):
            spoiled(value, rng)
            continue
        setattr(message, name, odd(kind, value, rng))
    return message


def odd(kind, value, rng):
    if kind == 'string':
        return rng.choice(TEXTS)
    if kind == 'boolean':
        return rng.random() < 0.5
    if kind.startswith('sequence<string'):
        return [rng.choice(TEXTS) for _ in range(rng.randrange(4))]
    if kind.startswith('sequence<uint8'):
        return array.array('B', rng.randbytes(rng.choice((0, 1, 7, 4096))))
    if kind == 'octet':
        return rng.randbytes(1)
    if '/' in kind or '[' in kind:
        return value
    if kind.startswith('sequence<'):
        return [float(rng.choice(NUMBERS)) for _ in range(rng.randrange(5))]
    if kind in ('float', 'double'):
        return float(rng.choice(NUMBERS))
    low, high = BOUNDS[kind]
    return rng.choice((low, high, 0, 1, rng.randint(low, high)))


@pytest.mark.parametrize('name', SPECS)
def test_node_survives_malformed_messages(name, ros_context):
    spec, rng = SPECS[name], random.Random(0)
    node = spec.load()(context=ros_context, cli_args=spec.ros_arguments())
    peer = CachedWaitSetExecutor(context=ros_context)
    speaker = Node('speaker', context=ros_context)
    peer.add_node(node)
    peer.add_node(speaker)
    publishers = {
        name: (topic, speaker.create_publisher(topic.type, name, topic.publisher_qos))
        for name, topic in node.subscribed_topics.items()
    }
    spin_until(peer, lambda: all(p.get_subscription_count() for _, p in publishers.values()))
    sizes = []
    for _ in range(3):
        for _ in range(60):
            for topic, publisher in publishers.values():
                message = spoiled(topic.type(), rng)
                publisher.publish(message)
            for _ in range(2 * len(publishers)):
                peer.spin_once(timeout_sec=0.0)
        sizes.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    for name, service in node.advertised_services.items():
        client = speaker.create_client(service, name)
        spin_until(peer, client.service_is_ready)
        requests = [service.Request(data=flag) for flag in (True, False)] if (
            service is SetBool
        ) else [service.Request()] * 2  # fmt: skip
        for request in requests:
            future = client.call_async(request)
            spin_until(peer, future.done)
            assert future.result().message
    reported = node.health.report(0.0).values
    assert all(int(reported[f'{name} received']) > 0 for name in publishers)
    assert isinstance(node.describe_parameter('use_sim_time'), ParameterDescriptor)
    assert sizes[2] - sizes[1] < 20_000, f'memory grows [kB]: {sizes}'
    # Odd input gives one clear sentence; a traceback would be a fault of the node.
    assert 'Traceback' not in node.health.report(0.0).message
    node.destroy_node()
    speaker.destroy_node()
