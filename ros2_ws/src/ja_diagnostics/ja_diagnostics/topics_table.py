"""The table of `./ja topics`: what the running graph publishes, how, how often, and why."""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rich.markup import escape
from rich.table import Table

from ja_common.core.config import ConfigError
from ja_common.message_types import message_class
from ja_common.private_context import private_executor
from ja_common.qos_text import common_profile
from ja_common.stop_signals import StopSignals
from ja_common.topics import TOPICS

_DISCOVERY_S = 0.6


@dataclass(frozen=True)
class TopicRow:
    """One topic of the graph; `rate_hz` is None where its type is not installed here."""

    name: str
    type: str
    quality: str
    publishers: list[str]
    subscribers: list[str]
    rate_hz: float | None
    purpose: str


def measure_topics(seconds: float, arguments: Sequence[str] = ()) -> list[TopicRow]:
    """Watch the graph for some seconds; return its topics by name, none if no node is there."""
    with StopSignals() as stop, private_executor(arguments) as executor:
        node = Node('topics_table', context=executor.context, enable_rosout=False)
        executor.add_node(node)
        _spin(executor, stop, _DISCOVERY_S)
        published = {
            name: types[0]
            for name, types in node.get_topic_names_and_types()
            if _others(node, node.get_publishers_info_by_topic(name))
        }
        counts: Counter[str] = Counter()
        unknown = [
            name for name, kind in published.items() if not _count(node, name, kind, counts)
        ]
        began_s = time.monotonic()
        _spin(executor, stop, seconds)
        elapsed_s = time.monotonic() - began_s
        rates = {name: None if name in unknown else counts[name] / elapsed_s for name in published}
        return [_row(node, name, published[name], rates[name]) for name in sorted(published)]


def table_of_topics(rows: Sequence[TopicRow]) -> Table:
    """Return the table that `./ja topics` prints."""
    table = Table(show_lines=False)
    for column in ('topic', 'type', 'quality', 'publishers', 'subscribers'):
        table.add_column(column, overflow='fold')
    table.add_column('Hz', justify='right')
    table.add_column('what it is', overflow='fold')
    for row in rows:
        rate = '?' if row.rate_hz is None else f'{row.rate_hz:.1f}'
        names = (', '.join(row.publishers), ', '.join(row.subscribers) or '-')
        # A unit such as [mm] is no markup.
        table.add_row(row.name, row.type, row.quality, *names, rate, escape(row.purpose))
    return table


def _count(node: Node, name: str, type_name: str, counts: Counter[str]) -> bool:
    """Count a topic's messages from now on, undecoded; False when its type is not installed."""
    try:
        kind = message_class(type_name)
    except ConfigError:
        return False

    def on_message(_: bytes) -> None:
        counts[name] += 1

    # A best-effort subscription matches every publisher, and slows none down.
    node.create_subscription(kind, name, on_message, common_profile(False, False), raw=True)
    return True


def _row(node: Node, name: str, type_name: str, rate_hz: float | None) -> TopicRow:
    publishers = _others(node, node.get_publishers_info_by_topic(name))
    subscribers = _others(node, node.get_subscriptions_info_by_topic(name))
    purposes = {topic.name.lstrip('/'): topic.purpose for topic in TOPICS}
    # Works in a namespace too: the longest of our names that the name ends with.
    fitting = [own for own in purposes if f'/{name}'.endswith(f'/{own}')]
    return TopicRow(
        name,
        type_name.replace('/msg/', '/'),
        '; '.join(sorted({_quality(end.qos_profile) for end in publishers})),
        sorted({end.node_name for end in publishers}),
        sorted({end.node_name for end in subscribers}),
        rate_hz,
        purposes[max(fitting, key=len)] if fitting else '',
    )


def _others(node: Node, ends: list[Any]) -> list[Any]:
    return [end for end in ends if end.node_name != node.get_name()]


def _quality(profile: QoSProfile) -> str:
    reliable = profile.reliability is ReliabilityPolicy.RELIABLE
    latched = profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    return ('reliable' if reliable else 'best effort') + (', latched' if latched else '')


def _spin(executor: Executor, stop: StopSignals, seconds: float) -> None:
    stop.call_at_request(executor.wake)
    end_s = time.monotonic() + seconds
    while (left_s := end_s - time.monotonic()) > 0:
        stop.raise_if_requested()
        executor.spin_once(timeout_sec=left_s)
