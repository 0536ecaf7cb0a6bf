"""The topic `look_at`: points that other nodes want the head to look at."""

from collections.abc import Callable

import numpy as np
from geometry_msgs.msg import PointStamped
from numpy.typing import NDArray

from ja_common.core.health import Level
from ja_common.core.posture import Posture, PostureHistory, PostureJoin
from ja_common.graph_node import GraphNode
from ja_common.time_codec import to_ns
from ja_common.topics import LOOK_AT
from ja_control.core.look_at import LookAtConfig, base_vector, checked_point, direction_to_take

Reachable = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class LookAtInput:
    """Turns each usable point into a direction; the others are refused, with one reason each.

    A point in the frame of the camera waits until the posture at its stamp is known.
    """

    def __init__(
        self,
        node: GraphNode,
        config: LookAtConfig,
        history: PostureHistory,
        check: Callable[[int], None],
        reachable: Reachable,
        turn_to: Callable[[NDArray[np.float64]], None],
    ) -> None:
        """Subscribe for a node.

        `check` raises ValueError while the head cannot turn, and for a stamp [ns] of another
        time. `reachable`: as in `direction_to_take`. `turn_to` takes the direction (2,) [rad].
        """
        self._node, self._config, self._history = node, config, history
        self._check, self._reachable, self._turn_to = check, reachable, turn_to
        self._waiting: PostureJoin[PointStamped] = PostureJoin(history)
        node.subscribe(LOOK_AT, self._on_point)

    def drop_waiting(self) -> None:
        """Drop the points that wait for their posture."""
        self._waiting = PostureJoin(self._history)

    def use_waiting(self) -> None:
        """Use the points whose posture has become known; call it repeatedly."""
        if len(self._waiting):
            for message, posture in self._waiting.pop_ready():
                self._report(self._use_in_camera, message, posture)

    def _on_point(self, message: PointStamped) -> None:
        self._report(self._use, message)

    def _use(self, message: PointStamped) -> None:
        stamp_ns = to_ns(message.header.stamp)
        in_camera = self._config.is_camera_frame(message.header.frame_id)
        vector = checked_point(_coordinates(message))
        self._check(stamp_ns)
        if not in_camera:
            self._turn_to(direction_to_take(vector, self._reachable))
        elif stamp_ns == 0:  # as in tf: whatever is the newest
            self._use_in_camera(message, self._history.newest)
        else:
            self._waiting.queue_item(stamp_ns, message)
            self.use_waiting()

    def _use_in_camera(self, message: PointStamped, posture: Posture | None) -> None:
        if posture is None:
            raise ValueError('the posture of the head at the stamp of the point is not known')
        self._check(to_ns(message.header.stamp))
        vector = base_vector(checked_point(_coordinates(message)), posture.position)
        self._turn_to(direction_to_take(vector, self._reachable))

    def _report(self, use: Callable[..., None], *arguments: object) -> None:
        name = self._node.resolve_topic_name(LOOK_AT.name)
        try:
            use(*arguments)
        except ValueError as error:
            self._node.report_problem(name, f'{name}: refused: {error}', Level.WARN)


def _coordinates(message: PointStamped) -> list[float]:
    point = message.point
    return [point.x, point.y, point.z]
