"""Every stamped message has a frame that is in the robot description, or none by convention."""

from collections import defaultdict

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from ja_common.executor import CachedWaitSetExecutor
from ja_common.head_description import BASE_FRAME, CAMERA_FRAME, WIDE_FRAME
from ja_common.topics import (
    BELIEF,
    CAMERA_INFO,
    CAMERA_POSE,
    DEPTH,
    DETECTIONS,
    EVIDENCE,
    FACE,
    FACE_IMAGE,
    FIXATION,
    IMAGE,
    IMAGE_ANNOTATED,
    JOINT_COMMANDS,
    JOINT_STATES,
    MARKERS,
    RIGHT_CAMERA_INFO,
    RIGHT_IMAGE,
    ROBOT_DESCRIPTION,
    SIM_TRUTH,
    TARGET,
    TOPICS,
    VF_DELTA,
    WIDE_IMAGE,
)
from ja_control.core.urdf_frames import FrameTree
from ja_runner.graph import rig_graph, sim_graph
from ja_runner.node_spec import NodeSpec
from picture_files import flat, write_picture
from ros_testing import spin_until

# Angles of joints are in no frame; the angles of directions are columns of a table, no points.
WITHOUT_FRAME = {JointState, JointTrajectory, DiagnosticArray}
TABLES_WITHOUT_FRAME = {BELIEF.name}
BESIDE = [NodeSpec('ja_control', 'head_frames'), NodeSpec('ja_dashboard', 'markers')]


def stamped(topic):
    return 'header' in topic.type.get_fields_and_field_types() or topic is MARKERS


class Listener(Node):
    """Subscribes to every stamped topic, and keeps the frames of each."""

    def __init__(self, context):
        super().__init__('listener', context=context)
        self.frames = defaultdict(set)
        self.urdf = ''
        for topic in filter(stamped, TOPICS):
            self.create_subscription(
                topic.type, topic.name, self.keeper_of(topic), topic.subscriber_qos
            )
        self.create_subscription(
            ROBOT_DESCRIPTION.type, ROBOT_DESCRIPTION.name, self.keep_urdf,
            ROBOT_DESCRIPTION.subscriber_qos,
        )  # fmt: skip

    def keeper_of(self, topic):
        def keep(message):
            parts = message.markers[1:] if topic is MARKERS else [message]
            self.frames[topic.name] |= {part.header.frame_id for part in parts}

        return keep

    def keep_urdf(self, message):
        self.urdf = message.data

    def check(self):
        """Compare the frames of all that came with those of the URDF; return them by topic."""
        frames = {*FrameTree(self.urdf).links}
        for topic in TOPICS:
            expected = frames
            if topic.type in WITHOUT_FRAME or topic.name in TABLES_WITHOUT_FRAME:
                expected = {''}
            assert self.frames[topic.name] <= expected, topic.name
        return self.frames


@pytest.fixture
def run(ros_context):
    """Return a function that runs a graph until all of some topics have come."""
    executor = CachedWaitSetExecutor(context=ros_context)
    nodes = []

    def run(graph, topics):
        listener = Listener(ros_context)
        nodes.append(listener)
        nodes.extend(
            spec.load()(context=ros_context, cli_args=spec.ros_arguments()) for spec in graph
        )
        for node in nodes:
            executor.add_node(node)
        names = {topic.name for topic in topics}
        spin_until(
            executor,
            lambda: listener.urdf and names <= {k for k, v in listener.frames.items() if v},
        )
        return listener

    yield run
    executor.shutdown()
    for node in nodes:
        node.destroy_node()


def test_the_simulated_head(run):
    senses = {'depth': 'exact', 'second_camera': 'on'}
    graph = sim_graph(sim_parameters={'scene': 'easy', **senses})
    listener = run(
        [*graph, *BESIDE],
        [IMAGE, CAMERA_INFO, DEPTH, RIGHT_IMAGE, RIGHT_CAMERA_INFO, JOINT_STATES, DETECTIONS,
         FACE, TARGET, IMAGE_ANNOTATED, FACE_IMAGE, VF_DELTA, EVIDENCE, FIXATION, JOINT_COMMANDS,
         SIM_TRUTH, CAMERA_POSE, MARKERS],
    )  # fmt: skip
    frames = listener.check()
    for topic in (IMAGE, DEPTH, RIGHT_IMAGE, DETECTIONS, FACE_IMAGE):
        assert frames[topic.name] == {CAMERA_FRAME}
    for topic in (SIM_TRUTH, CAMERA_POSE, MARKERS):
        assert frames[topic.name] == {BASE_FRAME}


def test_the_digital_head(run, tmp_path):
    """The wide camera stands still, so it has a frame of its own."""
    folder = tmp_path / 'pictures'
    write_picture(folder / 'grey.png', flat((128, 128, 128), (320, 240)))
    listener = run(
        [*rig_graph(str(folder)), *BESIDE],
        [WIDE_IMAGE, IMAGE, CAMERA_INFO, JOINT_STATES, DETECTIONS, CAMERA_POSE],
    )
    frames = listener.check()
    assert frames[WIDE_IMAGE.name] == {WIDE_FRAME}
    assert frames[IMAGE.name] == frames[DETECTIONS.name] == {CAMERA_FRAME}
