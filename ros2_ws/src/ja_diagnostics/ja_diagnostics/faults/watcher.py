"""A node that watches the running graph: the head's commands, and the gate's decisions."""

import time
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import JointState

from ja_common.graph_node import GraphNode
from ja_common.status_values import status_values
from ja_common.topics import DIAGNOSTICS, GATE_STATUS, JOINT_COMMANDS

_MOVED_RAD = 1e-4


class Watcher(GraphNode):
    """Records when commands move the head, and when the gate decides; steady-clock times [s]."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('fault_watcher', **node_kwargs)
        self.moved_s = 0.0
        self.speed_rad_s = 0.0
        self.decided_s = 0.0
        self.longest_pause_s = 0.0
        self.resumed_s: float | None = None
        self.trials = 0
        self.learned = 0
        self._position: np.ndarray | None = None
        self.subscribe(JOINT_COMMANDS, self._on_command)
        self.subscribe(GATE_STATUS, self._on_status)
        self.subscribe(DIAGNOSTICS, self._on_diagnostics)

    def restart_pauses(self) -> None:
        """Reset the longest time without a decision, and wait for the next decision."""
        self.longest_pause_s = 0.0
        self.resumed_s = None

    def _on_command(self, message: JointState) -> None:
        position = np.array(message.position)
        self.speed_rad_s = float(np.abs(message.velocity).max()) if message.velocity else 0.0
        if self._position is not None and np.abs(position - self._position).max() > _MOVED_RAD:
            self.moved_s = time.monotonic()
        self._position = position

    def _on_status(self, message: DiagnosticStatus) -> None:
        values = status_values(message)
        self.trials = int(values.get('trials', '0'))
        if 'source' in values:
            now_s = time.monotonic()
            self.longest_pause_s = max(self.longest_pause_s, now_s - self.decided_s)
            self.decided_s = now_s
            if self.resumed_s is None:
                self.resumed_s = now_s

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = status_values(status)
            if 'trials learned' in values:
                self.learned = int(values['trials learned'])
