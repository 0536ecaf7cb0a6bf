"""The same seed gives the same run of the whole graph, bit for bit, in both compositions."""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile

from ja_common.detection_codec import decode_detections
from ja_common.private_context import private_executor
from ja_common.time_codec import to_ns
from ja_common.topics import DETECTIONS, IMAGE, JOINT_COMMANDS, LM_DELTA
from ja_runner.graph import sim_graph
from ja_runner.node_spec import NodeSpec
from ja_runner.one_process import run_in_one_process
from ja_runner.supervisor import Supervisor

IMAGES = 150
DIGESTED: dict[str, Callable[[Any], bytes]] = {
    IMAGE.name: lambda message: bytes(message.data),
    DETECTIONS.name: lambda message: bytes(message.data),
    LM_DELTA.name: lambda message: np.array(message.position).tobytes(),
    JOINT_COMMANDS.name: lambda message: np.array(message.position).tobytes(),
}

pytestmark = [pytest.mark.usefixtures('domain'), pytest.mark.slow]


class DigestRecorder(Node):
    """Keeps a digest of each message about each image, and all digests if several differ."""

    def __init__(self, context: Context) -> None:
        super().__init__('digest_recorder', context=context)
        self.digests: dict[tuple[int, str], set[str]] = {}
        self.ranges = 0
        for topic in (IMAGE, DETECTIONS, LM_DELTA, JOINT_COMMANDS):
            keep = self._keeper(topic.name)
            self.create_subscription(topic.type, topic.name, keep, QoSProfile(depth=100))

    def _keeper(self, name: str) -> Callable[[Any], None]:
        def keep(message: Any) -> None:
            digest = hashlib.sha256(DIGESTED[name](message)).hexdigest()[:12]
            self.digests.setdefault((to_ns(message.header.stamp), name), set()).add(digest)
            if name == DETECTIONS.name:
                self.ranges += sum(isfinite(each.range_m) for each in decode_detections(message))

        return keep

    def has_seen_enough(self) -> bool:
        commands = sum(name == JOINT_COMMANDS.name for _, name in self.digests)
        return commands > IMAGES

    def run(self) -> list[tuple[int, str, set[str]]]:
        """Return the digests of `IMAGES` images by stamp and topic."""
        stamps = sorted({stamp for stamp, _ in self.digests})[:IMAGES]
        return [(*key, self.digests[key]) for key in sorted(self.digests) if key[0] <= stamps[-1]]


def graph(draw_ahead: bool, depth: str = 'none') -> list[NodeSpec]:
    """Let half of the gaze shifts follow the learner, so that its state shows in the commands."""
    changes = {
        'gate': {'gating': 'constant', 'p_lm_max': 0.5},
        'salient_feature_detector': {'depth': depth, 'depth_wait_s': 60.0},
    }
    small = {
        'scene': 'default', 'image_width': 160, 'image_height': 120, 'draw_ahead': draw_ahead,
        'depth': {'picture': 'sensor'}.get(depth, 'none'),
        'second_camera': {'second_camera': 'on'}.get(depth, 'off'),
    }  # fmt: skip
    return [
        replace(node, parameters={**node.parameters, **changes.get(node.executable, {})})
        for node in sim_graph(seed=5, sim_parameters=small)
    ]


def run_in_one(draw_ahead: bool, depth: str = 'none') -> DigestRecorder:
    recorder: list[DigestRecorder] = []

    def make(context: Context) -> DigestRecorder:
        recorder.append(DigestRecorder(context))
        return recorder[0]

    nodes = graph(draw_ahead, depth)
    assert run_in_one_process(nodes, make, lambda: recorder[0].has_seen_enough()) == 0
    return recorder[0]


def run_in_many(folder: Path, draw_ahead: bool, depth: str = 'none') -> DigestRecorder:
    with private_executor() as executor:
        recorder = DigestRecorder(executor.context)
        executor.add_node(recorder)

        def tick() -> bool:
            executor.spin_once(timeout_sec=0.1)
            return recorder.has_seen_enough()

        assert Supervisor(graph(draw_ahead, depth), folder).run(tick) == 0
    return recorder


@pytest.mark.parametrize('draw_ahead', [False, True])
def test_the_same_seed_gives_the_same_run_in_one_process_and_in_many(tmp_path, draw_ahead):
    first = run_in_one(draw_ahead)
    others = [run_in_many(tmp_path / name, draw_ahead) for name in ('1', '2')]
    assert_same(first, others)
    assert first.ranges == 0


@pytest.mark.parametrize('depth', ['picture', 'second_camera'])
def test_so_it_does_with_ranges(tmp_path, depth):
    first = run_in_one(draw_ahead=True, depth=depth)
    assert_same(first, [run_in_many(tmp_path, draw_ahead=True, depth=depth)])
    assert first.ranges > IMAGES / 2


def assert_same(first: DigestRecorder, others: list[DigestRecorder]) -> None:
    expected = first.run()
    assert len({stamp for stamp, _, _ in expected}) == IMAGES
    for other in others:
        for ours, theirs in zip(expected, other.run(), strict=True):
            assert ours == theirs, 'the first message that differs'
    assert all(len(digests) == 1 for _, _, digests in expected), 'one message for each image'
