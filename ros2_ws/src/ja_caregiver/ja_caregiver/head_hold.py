"""Holds the head while no trial may happen: by the gate's own switch."""

from rclpy.task import Future
from std_srvs.srv import SetBool

from ja_common.graph_node import GraphNode


class HeadHold:
    """Calls the gate's `enable`. It enables only what it has disabled itself."""

    def __init__(self, node: GraphNode) -> None:
        self._client = node.create_client(SetBool, 'gate/enable')
        self._holds = False
        self._pending: Future | None = None

    def update(self, wanted: bool, enabled: bool) -> None:
        """Hold the head, or let it go; `enabled`: whether the gate reports that it moves it.

        Call it often: the gate may not be there yet, or another node may have enabled it.
        """
        if self._pending is not None and not self._pending.done():
            return
        self._pending = None
        if wanted and enabled:
            self._call(False)
        elif not wanted and self._holds:
            if enabled:
                self._holds = False
            else:
                self._call(True)

    def _call(self, enable: bool) -> None:
        if not self._client.service_is_ready():
            return
        self._pending = self._client.call_async(SetBool.Request(data=enable))
        if not enable:
            self._holds = True
