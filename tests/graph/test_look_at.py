"""Another node points the head in a running graph: it obeys, and nothing is learned from that."""

from functools import partial

import numpy as np
import pytest
from geometry_msgs.msg import Point, PointStamped
from rclpy.node import Node

from ja_common.core.geometry import vectors_of_directions
from ja_common.executor import CachedWaitSetExecutor
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.point_cloud_codec import decode_columns
from ja_common.private_context import private_context
from ja_common.status_values import status_values
from ja_common.topics import FIXATION, GATE_STATUS, JOINT_STATES, LOOK_AT, SCORE, SIM_TRUTH
from ja_runner.graph import sim_graph
from ros_testing import spin_until

pytestmark = pytest.mark.usefixtures('domain')

_SMALL = {
    'scene': 'default', 'image_width': 160, 'image_height': 120, 'depth': 'none',
    'second_camera': 'off',
}  # fmt: skip


class Pointer(Node):
    """Points the head at an object whenever it begins a shift, as long as `interrupts`."""

    def __init__(self, context):
        super().__init__('pointer', context=context)
        self.interrupts = True
        self.fixated_there = 0
        self.pointed = 0
        self.nearest_rad = np.inf
        self.posture = np.zeros(2)
        self.objects = np.empty((0, 2))
        self.trials_scored = 0
        self._aim = np.zeros(2)
        self._phase = ''
        self._joints = JointCodec(JointConfig())
        self._points = self.create_publisher(LOOK_AT.type, LOOK_AT.name, 10)
        for topic, callback in (
            (GATE_STATUS, self._on_status),
            (JOINT_STATES, self._on_joints),
            (SIM_TRUTH, self._on_truth),
            (FIXATION, self._on_fixation),
            (SCORE, self._on_score),
        ):
            self.create_subscription(topic.type, topic.name, callback, topic.publisher_qos)

    def _on_status(self, message):
        self._phase = status_values(message)['phase']
        if self._phase in ('shift', 'glance') and self.interrupts and len(self.objects):
            far = np.abs(self.objects - self.posture).max(axis=1)
            self._aim = self.objects[np.argmax(far)]
            x, y, z = 1.5 * vectors_of_directions(self._aim)
            point = PointStamped(point=Point(x=x, y=y, z=z))
            point.header.frame_id = 'base_link'
            self._points.publish(point)
            self.pointed += 1

    def _on_joints(self, message):
        self.posture = self._joints.decode_posture(message)
        if self._phase == 'look_at':
            off = float(np.abs(self.posture - self._aim).max())
            self.nearest_rad = min(self.nearest_rad, off)

    def _on_truth(self, message):
        columns = decode_columns(message, ['pan', 'tilt'])
        self.objects = np.column_stack([columns['pan'], columns['tilt']])

    def _on_fixation(self, message):
        self.fixated_there += self._phase == 'look_at' and bool(message.name)

    def _on_score(self, message):
        self.trials_scored += 1


def test_the_head_looks_where_another_node_points_and_learns_nothing_from_it():
    learned = []
    changes = {'gate': {'look_at_hold_s': 1.5}}
    with private_context() as context:
        executor = CachedWaitSetExecutor(context=context)
        nodes = []
        try:
            for spec in sim_graph(seed=5, sim_parameters=_SMALL):
                spec.parameters.update(changes.get(spec.executable, {}))
                make = spec.load()
                if spec.executable == 'learning_module':
                    make = partial(make, on_update=lambda trial, stamp_ns: learned.append(trial))
                arguments = spec.ros_arguments()
                nodes.append(make(context=context, cli_args=arguments, use_global_arguments=False))
            pointer = Pointer(context)
            nodes.append(pointer)
            for node in nodes:
                executor.add_node(node)
            spin_until(executor, lambda: pointer.pointed >= 4 and pointer.fixated_there >= 20)
            assert pointer.nearest_rad < 0.02
            assert learned == [], 'neither fixations there nor trials that were given up'
            assert pointer.trials_scored == 0
            pointer.interrupts = False
            spin_until(executor, lambda: len(learned) >= 2 and pointer.trials_scored >= 1)
        finally:
            executor.shutdown()
            for node in reversed(nodes):
                node.destroy_node()
