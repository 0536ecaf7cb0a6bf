"""From a picture of the camera to the command that answers it, hop by hop, at 640x480 and 30 Hz.

Each time is the source timestamp of DDS: the publisher's host sets it when it hands over the
message, so a late subscriber does not change it. The camera info goes out just before the picture;
its time stands for the picture's, so that publishing the picture is counted as well. The gate
commands at its own rate: on average, half a control period (2.5 ms) of the last hop is waiting.

Camera and head are the sim's, in their own processes as drivers are on a rig. The attention nodes
run in one process or in many.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from rclpy.node import Node

from ja_benchmarks.benchmarks.graph import WARM_UP_S, run_for_benchmark
from ja_benchmarks.rows import Row, percentile_99, row
from ja_common.core.stamps import NS_PER_S
from ja_common.ros_arguments import parameter_arguments
from ja_common.time_codec import to_ns
from ja_common.topics import (
    CAMERA_INFO,
    DETECTIONS,
    FIXATION,
    JOINT_COMMANDS,
    LM_DELTA,
    VF_DELTA,
    Topic,
)
from ja_runner.companion import Companion
from ja_runner.graph import sim_graph, with_arguments
from ja_runner.progress import ProgressNode

MEASURE_S = 20.0
CAMERA = {
    'lockstep': False, 'camera_rate_hz': 30.0, 'image_width': 640, 'image_height': 480,
}  # fmt: skip
# In the order in which the messages of one picture are made.
HOPS = (DETECTIONS, VF_DELTA, LM_DELTA, FIXATION, JOINT_COMMANDS)


def run() -> dict[str, Row]:
    """Measure in both compositions: median and 99th percentile from picture to each topic."""
    rows: dict[str, Row] = {}
    graph = with_arguments(sim_graph(), parameter_arguments(CAMERA))
    head = [spec for spec in graph if spec.package == 'ja_sim']
    attention = [spec for spec in graph if spec not in head]
    for name, one_process in (('many processes', False), ('one process', True)):
        stopwatch = Stopwatch(HOPS)
        with ExitStack() as beside:
            folder = Path(beside.enter_context(TemporaryDirectory()))
            for spec in head:
                beside.enter_context(Companion(spec, folder, print, announcement=''))
            run_for_benchmark(attention, stopwatch.tick, one_process)
        rows |= {f'{figure}, {name}': found for figure, found in stopwatch.rows().items()}
    return rows


class Stopwatch:
    """The times at which the first message of each picture was published on each topic."""

    def __init__(self, hops: Sequence[Topic]) -> None:
        self._topics = (CAMERA_INFO, *hops)
        self._published_ns: dict[int, dict[str, int]] = defaultdict(dict)
        self._subscribed = False

    def tick(self, node: ProgressNode) -> bool:
        """Subscribe after the warm-up; return True when the measurement is over."""
        if not self._subscribed and node.elapsed_s > WARM_UP_S:
            self._subscribed = True
            for topic in self._topics:
                self._subscribe(node, topic)
        return node.elapsed_s > WARM_UP_S + MEASURE_S

    def _subscribe(self, node: Node, topic: Topic) -> None:
        def note(message: Any, information: dict[str, int]) -> None:
            times = self._published_ns[to_ns(message.header.stamp)]
            times.setdefault(topic.name, information['source_timestamp'])

        node.create_subscription(topic.type, topic.name, note, topic.subscriber_qos)

    def rows(self) -> dict[str, Row]:
        """Return the figures; pictures without a command (a held head) have a row of their own."""
        first, last = self._topics[0].name, self._topics[-1].name
        seen = [times for times in self._published_ns.values() if first in times]
        rounds = [times for times in seen if len(times) == len(self._topics)]
        rows: dict[str, Row] = {}
        statistics: tuple[tuple[str, Callable[..., Any]], ...] = (
            ('median', np.median),
            ('99th percentile', percentile_99),
        )
        for topic in self._topics[1:]:
            delays_ms = [1e3 * (times[topic.name] - times[first]) / NS_PER_S for times in rounds]
            for name, statistic in statistics:
                rows[f'picture to {topic.name}, {name}'] = row(delays_ms, 'ms', statistic)
        answered = [float(last in times) for times in seen]
        return rows | {'pictures that a command answers': row(answered, 'share')}
