"""echo_detections: prints detections as a table."""

import math
import os
import sys
from collections.abc import Sequence
from typing import Any

from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import PointCloud2

from ja_common.core.detection import Detection
from ja_common.detection_codec import decode_detections
from ja_common.graph_node import GraphNode
from ja_common.node_main import spin_node
from ja_common.time_codec import to_ns
from ja_common.topics import DETECTIONS

_HEAD = (
    '  kind     id       u       v   width  height  score  f_col  f_edg  f_mot  attended  range'
)


class EchoDetectionsNode(GraphNode):
    """Prints every detections message to the standard output."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('echo_detections', **node_kwargs)
        self.subscribe(DETECTIONS, self._on_detections, expected_every_s=2.0)

    def _on_detections(self, message: PointCloud2) -> None:
        text = format_detections(to_ns(message.header.stamp), decode_detections(message))
        try:
            print(text, flush=True)
        except BrokenPipeError:
            # The reader (`| head`) has closed the pipe: Python would fail again as it ends.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise ExternalShutdownException from None


def format_detections(stamp_ns: int, detections: list[Detection]) -> str:
    """Format the detections of one image as a table."""
    title = f'{stamp_ns / 1e9:.3f} s: {len(detections)} seen'
    return '\n'.join([title, *([_HEAD] if detections else []), *map(_line, detections)])


def _line(d: Detection) -> str:
    return (
        f'  {d.kind.name.lower():<7}{d.track_id:>4}{d.u:>8.1f}{d.v:>8.1f}{d.width:>8.1f}'
        f'{d.height:>8.1f}{d.score:>7.2f}{d.f_col:>7.2f}{d.f_edg:>7.2f}{d.f_mot:>7.2f}'
        f'  {"yes" if d.attended else "":<8}{_metres(d):>7}'
    ).rstrip()


def _metres(d: Detection) -> str:
    return f'{d.range_m:.2f} m' if math.isfinite(d.range_m) else ''


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    spin_node(EchoDetectionsNode, args)


if __name__ == '__main__':
    main()
