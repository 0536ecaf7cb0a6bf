"""Keeps the names of nodes known to each other after one of them was halted."""

import math

from rclpy.node import Node

from ja_common.ros_defaults import LEASE_S
from ja_common.topics import DIAGNOSTICS


class DiscoveryRefresher:
    """Announces a node's name again where DDS would leave it forgotten.

    Participants that do not receive from each other for a lease (a process was halted) separate,
    and later discover each other again, with all topics. The names of ROS nodes are sent apart
    from that, and only when an entity is made or destroyed: a participant that has dropped a name
    does not receive it again, and `ros2 node list` lacks it from then on.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        # Counts from the first call: a node that still loads its model is not halted.
        self._refreshed_s = math.inf
        self._present: set[tuple[str, str]] = set()
        self._known: set[tuple[str, str]] = set()

    def refresh(self, now_s: float) -> float:
        """Announce the node again if needed; return how long it was halted [s].

        Call it every second; `now_s`: steady time [s]. 0.0 unless the halt exceeded the lease.
        """
        since_s, self._refreshed_s = now_s - self._refreshed_s, now_s
        before = self._present
        self._present = set(self._node.get_node_names_and_namespaces())
        returned = self._present & self._known - before
        self._known |= self._present
        halted_s = since_s if since_s > LEASE_S else 0.0
        if halted_s or returned:
            self._announce()
        return halted_s

    def _announce(self) -> None:
        node = self._node
        publisher = node.create_publisher(
            DIAGNOSTICS.type, DIAGNOSTICS.name, DIAGNOSTICS.publisher_qos
        )
        node.destroy_publisher(publisher)
