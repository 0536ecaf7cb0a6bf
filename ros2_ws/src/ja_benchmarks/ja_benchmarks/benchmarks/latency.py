"""From a picture of the camera to the command that answers it, hop by hop, at 640x480 and 30 Hz.

Each time is that at which DDS was given the message, as its publisher's host says: no listener,
however late, makes it longer or shorter. The camera info goes out just before the picture; its
time stands for the picture's, so that handing over the picture is counted as well. The gate
commands at its own rate: half a control period (2.5 ms) of the last hop is waiting, on average.

Camera and head are the sim's, in processes of their own as drivers are on a rig; it is the mind
that is composed in one process or in many.
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
    """In both compositions: median and 99th percentile from the picture to each topic."""
    rows: dict[str, Row] = {}
    graph = with_arguments(sim_graph(), parameter_arguments(CAMERA))
    head = [spec for spec in graph if spec.package == 'ja_sim']
    mind = [spec for spec in graph if spec not in head]
    for name, one_process in (('many processes', False), ('one process', True)):
        stopwatch = Stopwatch(HOPS)
        with ExitStack() as beside:
            folder = Path(beside.enter_context(TemporaryDirectory()))
            for spec in head:
                beside.enter_context(Companion(spec, folder, print, announcement=''))
            run_for_benchmark(mind, stopwatch.tick, one_process)
        rows |= {f'{figure}, {name}': found for figure, found in stopwatch.rows().items()}
    return rows


class Stopwatch:
    """When the first message of each picture was published on each topic."""

    def __init__(self, hops: Sequence[Topic]) -> None:
        self._topics = (CAMERA_INFO, *hops)
        self._said_ns: dict[int, dict[str, int]] = defaultdict(dict)
        self._hearing = False

    def tick(self, node: ProgressNode) -> bool:
        """To be called while the graph runs; True when it was watched for long enough."""
        if not self._hearing and node.elapsed_s > WARM_UP_S:
            self._hearing = True
            for topic in self._topics:
                self._listen(node, topic)
        return node.elapsed_s > WARM_UP_S + MEASURE_S

    def _listen(self, node: Node, topic: Topic) -> None:
        def note(message: Any, information: dict[str, int]) -> None:
            said = self._said_ns[to_ns(message.header.stamp)]
            said.setdefault(topic.name, information['source_timestamp'])

        node.create_subscription(topic.type, topic.name, note, topic.subscriber_qos)

    def rows(self) -> dict[str, Row]:
        """The figures; pictures without a command (the head was held) are counted apart."""
        first, last = self._topics[0].name, self._topics[-1].name
        seen = [said for said in self._said_ns.values() if first in said]
        rounds = [said for said in seen if len(said) == len(self._topics)]
        rows: dict[str, Row] = {}
        statistics: tuple[tuple[str, Callable[..., Any]], ...] = (
            ('median', np.median),
            ('99th percentile', percentile_99),
        )
        for topic in self._topics[1:]:
            delays_ms = [1e3 * (said[topic.name] - said[first]) / NS_PER_S for said in rounds]
            for name, statistic in statistics:
                rows[f'picture to {topic.name}, {name}'] = row(delays_ms, 'ms', statistic)
        answered = [float(last in said) for said in seen]
        return rows | {'pictures that a command answers': row(answered, 'share')}
