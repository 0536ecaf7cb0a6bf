"""What a node saves beside its answers: in the background, with its failure in the health."""

from collections.abc import Callable

from rclpy.clock import Clock, ClockType

from ja_common.core.background_save import BackgroundSave
from ja_common.graph_node import GraphNode

_REPORT_EVERY_S = 1.0


class ReportedSave:
    """A `BackgroundSave` of a node: a failure is an ERROR of the node until the save succeeds."""

    def __init__(self, node: GraphNode, where: str, save: Callable[[], None]) -> None:
        """Start the thread that saves.

        `where` names what is saved, for the health. `save` raises OSError with one sentence.
        """
        self._node = node
        self._where = where
        self._failed = False
        self._save = BackgroundSave(save)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(_REPORT_EVERY_S, self._report, clock=steady)

    def request(self) -> None:
        """Ask for a save, which is made in another thread; return at once."""
        self._save.request()

    def close(self) -> None:
        """Save what is not saved yet, and end; call it when the node is destroyed."""
        self._save.close()
        self._report()

    def _report(self) -> None:
        error = self._save.error
        if error is not None:
            self._node.report_problem(self._where, f'{self._where}: not saved: {error}')
        elif self._failed:
            self._node.health.clear_problem(self._where)
            self._node.get_logger().info(f'{self._where}: saved')
        self._failed = error is not None
