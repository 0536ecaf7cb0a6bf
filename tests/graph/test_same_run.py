"""The same seed gives the same run of the whole graph, bit for bit, in whatever composition."""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile

from ja_common.executor import CachedWaitSetExecutor
from ja_common.time_codec import to_ns
from ja_common.topics import DETECTIONS, IMAGE, JOINT_COMMANDS, LM_DELTA
from ja_runner.graph import sim_graph
from ja_runner.node_spec import NodeSpec
from ja_runner.one_process import run_in_one_process
from ja_runner.supervisor import Supervisor

IMAGES = 150
WITNESSED: dict[str, Callable[[Any], bytes]] = {
    IMAGE.name: lambda message: bytes(message.data),
    DETECTIONS.name: lambda message: bytes(message.data),
    LM_DELTA.name: lambda message: np.array(message.position).tobytes(),
    JOINT_COMMANDS.name: lambda message: np.array(message.position).tobytes(),
}

pytestmark = [pytest.mark.usefixtures('domain'), pytest.mark.slow]


class Witness(Node):
    """Keeps a digest of what was said about each image, and all there were if several differ."""

    def __init__(self, context: Context) -> None:
        super().__init__('witness', context=context)
        self.said: dict[tuple[int, str], set[str]] = {}
        for topic in (IMAGE, DETECTIONS, LM_DELTA, JOINT_COMMANDS):
            hear = self._keeper(topic.name)
            self.create_subscription(topic.type, topic.name, hear, QoSProfile(depth=100))

    def _keeper(self, name: str) -> Callable[[Any], None]:
        def keep(message: Any) -> None:
            digest = hashlib.sha256(WITNESSED[name](message)).hexdigest()[:12]
            self.said.setdefault((to_ns(message.header.stamp), name), set()).add(digest)

        return keep

    def has_seen_enough(self) -> bool:
        commands = sum(name == JOINT_COMMANDS.name for _, name in self.said)
        return commands > IMAGES

    def run(self) -> list[tuple[int, str, set[str]]]:
        """What was said, by stamp and topic, of so many images."""
        stamps = sorted({stamp for stamp, _ in self.said})[:IMAGES]
        return [(*key, self.said[key]) for key in sorted(self.said) if key[0] <= stamps[-1]]


def graph(draw_ahead: bool) -> list[NodeSpec]:
    """Half of the shifts follow the learner, so that all it has learned shows in the commands."""
    gate = {'gating': 'constant', 'p_lm_max': 0.5}
    small = {
        'scene': 'default', 'image_width': 160, 'image_height': 120, 'draw_ahead': draw_ahead,
    }  # fmt: skip
    return [
        replace(node, parameters={**node.parameters, **gate})
        if node.executable == 'gate'
        else node
        for node in sim_graph(seed=5, sim_parameters=small)
    ]


def run_in_one(draw_ahead: bool) -> Witness:
    witness: list[Witness] = []

    def make(context: Context) -> Witness:
        witness.append(Witness(context))
        return witness[0]

    assert run_in_one_process(graph(draw_ahead), make, lambda: witness[0].has_seen_enough()) == 0
    return witness[0]


def run_in_many(folder: Path, draw_ahead: bool) -> Witness:
    context = Context()
    rclpy.init(args=[], context=context)
    executor = CachedWaitSetExecutor(context=context)
    witness = Witness(context)
    executor.add_node(witness)

    def tick() -> bool:
        executor.spin_once(timeout_sec=0.1)
        return witness.has_seen_enough()

    try:
        assert Supervisor(graph(draw_ahead), folder, 'stop', print).run(tick) == 0
    finally:
        executor.shutdown()
        witness.destroy_node()
        context.try_shutdown()
    return witness


@pytest.mark.parametrize('draw_ahead', [False, True])
def test_the_same_seed_gives_the_same_run_in_one_process_and_in_many(tmp_path, draw_ahead):
    first = run_in_one(draw_ahead)
    others = [run_in_many(tmp_path / name, draw_ahead) for name in ('1', '2')]
    expected = first.run()
    assert len({stamp for stamp, _, _ in expected}) == IMAGES
    for other in others:
        for ours, theirs in zip(expected, other.run(), strict=True):
            assert ours == theirs, 'the first message that differs'
    assert all(len(digests) == 1 for _, _, digests in expected), 'one answer, however often asked'
