"""Keeps the names of nodes known to each other, however long one of them has stood still."""

import math

from rclpy.node import Node

from ja_common.ros_defaults import LEASE_S
from ja_common.topics import DIAGNOSTICS


class DiscoveryRefresher:
    """Introduces a node anew where DDS would leave its name forgotten.

    Participants that have not heard each other for a lease (a process was halted) part, and meet
    again by themselves, topics and all. The names of ROS's nodes travel apart from that, only when
    an entity is made or destroyed: whoever has forgotten one is not told it a second time, and
    `ros2 node list` lacks it for good.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        # From the first look on: while a node loads its model it is nobody's concern yet.
        self._looked_s = math.inf
        self._present: set[tuple[str, str]] = set()
        self._known: set[tuple[str, str]] = set()

    def refresh(self, now_s: float) -> float:
        """To be called every second (steady clock [s]); how long this node has stood still [s].

        0.0 unless that was longer than others wait for a sign of life.
        """
        since_s, self._looked_s = now_s - self._looked_s, now_s
        before = self._present
        self._present = set(self._node.get_node_names_and_namespaces())
        returned = self._present & self._known - before
        self._known |= self._present
        halted_s = since_s if since_s > LEASE_S else 0.0
        if halted_s or returned:
            self._introduce()
        return halted_s

    def _introduce(self) -> None:
        node = self._node
        publisher = node.create_publisher(
            DIAGNOSTICS.type, DIAGNOSTICS.name, DIAGNOSTICS.publisher_qos
        )
        node.destroy_publisher(publisher)
