"""`ros2 param` and `ros2 topic info`: every node answers as its documentation says."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
import yaml
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

from ja_bringup.reference import COMPANIONS, NODES, every_node
from ja_common.executor import CachedWaitSetExecutor
from ros_testing import spin_until

ALL = (*NODES, *COMPANIONS)
Ask = Callable[..., Any]


def asker(tool: Node, node: Node) -> Ask:
    """Return a function that waits for the node's answer to a request of the tool."""
    executor = CachedWaitSetExecutor(context=node.context)
    executor.add_node(tool)
    executor.add_node(node)

    def ask(question: Callable[..., Any], *args: Any) -> Any:
        future = question(*args)
        spin_until(executor, future.done)
        return future.result()

    return ask


def dumped(client: AsyncParameterClient, ask: Ask) -> dict[str, Any]:
    """Return what `ros2 param dump` writes of a node."""
    names = sorted(ask(client.list_parameters).result.names)
    values = ask(client.get_parameters, names).values
    return {name: parameter_value_to_python(v) for name, v in zip(names, values, strict=True)}


def test_parameters_survive_dump_and_load(domain: int, tmp_path: Path) -> None:
    """By `ros2 param load`, which refuses nothing, and as the file of a new node."""
    path = tmp_path / 'dump.yaml'
    with every_node(ALL) as nodes:
        tool = rclpy.create_node('tool', context=nodes[0].context)
        before = {}
        for node in nodes:
            ask = asker(tool, node)
            client = AsyncParameterClient(tool, node.get_fully_qualified_name())
            assert client.wait_for_services(5.0)
            before[node.get_name()] = dumped(client, ask)
            names = list(before[node.get_name()])
            section = {
                node.get_fully_qualified_name(): {'ros__parameters': before[node.get_name()]}
            }
            path.write_text(yaml.safe_dump(section))
            results = ask(client.load_parameter_file, str(path)).results
            refused = {
                n: r.reason for n, r in zip(names, results, strict=True) if not r.successful
            }
            described = ask(client.describe_parameters, names).descriptors
            fixed = {d.name for d in described if d.read_only}
            assert fixed, 'rclpy itself gives every node one that is read-only'
            assert not refused, refused
            assert dumped(client, ask) == before[node.get_name()]
        tool.destroy_node()
    # These must be given, and were.
    for owner, name in (('camera', 'source'), ('player', 'recording'), ('recorder', 'folder')):
        del before[owner][name]
    path.write_text(yaml.safe_dump({n: {'ros__parameters': v} for n, v in before.items()}))
    with every_node(ALL, ['--params-file', str(path)]) as nodes:
        for node in nodes:
            for name, value in before[node.get_name()].items():
                assert node.get_parameter(name).value == value, (node.get_name(), name)


def test_publishers_and_subscribers_have_the_quality_of_service_of_the_table(domain: int) -> None:
    with every_node(ALL) as nodes:
        seen = 0
        for node in nodes:
            endpoints = [(e, node.published_topics, 'publisher_qos') for e in node.publishers]
            endpoints += [
                (e, node.subscribed_topics, 'subscriber_qos') for e in node.subscriptions
            ]
            for endpoint, table, side in endpoints:
                name = endpoint.topic_name
                if name in table:
                    seen += 1
                    wanted = getattr(table[name], side)
                    for part in ('reliability', 'durability', 'history', 'depth'):
                        found = getattr(endpoint.qos_profile, part)
                        assert found == getattr(wanted, part), (node.get_name(), name, part)
        assert seen > 60
