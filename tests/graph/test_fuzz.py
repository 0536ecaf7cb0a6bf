"""Malformed and foreign messages on every topic of every node, and odd requests: no node dies."""

import random
import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Header

from ja_common.detection_codec import encode_detections
from ja_common.executor import CachedWaitSetExecutor
from ja_common.graph_node import GraphNode
from ja_common.image_codec import encode_image
from ja_common.rclpy_private import parameter_names
from ja_common.time_codec import to_time
from ja_common.topics import (
    DETECTIONS,
    DIAGNOSTICS,
    FACE_GAZE,
    FACE_LANDMARKS,
    IMAGE,
    JOINT_STATES,
    SIM_TRUTH,
    TOPICS,
)
from ja_dashboard.core.drawings import from_above, postures
from ja_dashboard.page import facts_html, nodes_html
from ja_dashboard.view_node import ViewNode
from ja_runner.graph import rig_graph, sim_graph
from ja_runner.node_spec import NodeSpec
from node_bench import joint_state
from odd_messages import extreme, foreign, garbled, malformed
from recordings import write_recording
from ros_testing import spin_until

PACKAGES = Path(__file__).parents[2] / 'ros2_ws' / 'src'
PRESETS = {spec.executable: spec.parameters for spec in [*sim_graph(), *rig_graph('unused')]}
ROUNDS, SETS_A_ROUND = 3, 25
FEW_SETS = 8  # on all topics there are, for a node that subscribes to none or to all of them
_SENSES = {FACE_GAZE, FACE_LANDMARKS}  # the page subscribes to what has a publisher
ODD_VALUES = (float('nan'), -1e30, 2**62, '\x01', True, [1.0, 2.0], ['', 'x'])


# They need a film with its schedule, or message types that the wheels lack; each has node tests of
# its own.
_NEED_MORE = {'film_session', 'standard_outputs'}


def found_nodes() -> list[NodeSpec]:
    """Return every node of every package; a new one is among them."""
    return [
        NodeSpec(path.parent.name, path.stem.removesuffix('_node'))
        for path in sorted(PACKAGES.glob('*/*/*_node.py'))
        if path.parent.name == path.parents[1].name != 'ja_common'
        and path.stem.removesuffix('_node') not in _NEED_MORE
    ]


def test_every_kind_of_node_is_found():
    found = {spec.executable for spec in found_nodes()}
    assert {*PRESETS, 'view', 'recorder', 'player', 'camera', 'echo_detections'} <= found


@pytest.fixture
def needed(tmp_path) -> dict[str, dict[str, str]]:
    """Return the parameters without which a node cannot be made."""
    cv2.imwrite(str(tmp_path / 'picture.png'), np.zeros((48, 64, 3), np.uint8))
    recording = write_recording(
        tmp_path / 'played', [(i * 10**9, JOINT_STATES, joint_state(0, 0.1, 0.0)) for i in (0, 99)]
    )
    return {
        'camera': {'source': str(tmp_path / 'picture.png')},
        'player': {'recording': str(recording)},
        'recorder': {'folder': str(tmp_path / 'recorded')},
    }


class _Attack:
    """A node, and a foreign one that publishes on its topics and calls its services."""

    def __init__(self, node: GraphNode, context: Any) -> None:
        self.node = node
        self.rng = random.Random(0)
        self.problems: list[str] = []
        self.reports = 0
        self._executor = CachedWaitSetExecutor(context=context)
        self._speaker = Node('speaker', context=context)
        for each in (node, self._speaker):
            self._executor.add_node(each)
        self._keep_problems()
        self._speaker.create_subscription(
            DIAGNOSTICS.type, DIAGNOSTICS.name, self._on_diagnostics, DIAGNOSTICS.subscriber_qos
        )
        topics = set(node.subscribed_topics.values())
        if isinstance(node, ViewNode):
            self.spin_until(lambda: SIM_TRUTH in node.polled_subscriptions)
            topics |= node.polled_subscriptions.keys() | _SENSES
        names = {topic.name for topic in topics}
        self._publishers = [
            (topic, self._speaker.create_publisher(topic.type, topic.name, topic.publisher_qos))
            for topic in TOPICS
            # The recorder subscribes to whatever there is.
            if topic.name in names or not names
        ]
        self.spin_until(self._is_heard)
        if isinstance(node, ViewNode):
            self.spin_until(lambda: node.polled_subscriptions.keys() >= _SENSES)

    def close(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self._speaker.destroy_node()

    def spin_until(self, condition: Callable[[], object]) -> None:
        def tended() -> object:
            self._tend()
            return condition()

        spin_until(self._executor, tended)

    def publish_set(self, stamp_ns: int) -> None:
        """Publish one message of each kind on every topic, in any order."""
        header = Header(stamp=to_time(stamp_ns), frame_id='eye')
        for topic, publisher in self._publishers:
            odd = malformed(topic.type, self.rng)
            messages = [
                odd, garbled(odd, self.rng), extreme(topic.type, header, self.rng),
                self.rng.choice(foreign(topic.type, header)),
            ]  # fmt: skip
            for message in self.rng.sample(messages, len(messages)):
                publisher.publish(message)
        self._tend()
        for _ in range(6 * len(self._publishers)):
            self._executor.spin_once(timeout_sec=0.0)

    def show_good_image(self) -> None:
        """Publish good images with their detections until the page shows one."""
        stamps: list[int] = []

        def is_shown() -> bool:
            stamps.append(10**12 + len(stamps) * 10**8)
            header = Header(stamp=to_time(stamps[-1]), frame_id='eye')
            picture = np.zeros((24, 32, 3), np.uint8)
            for topic, publisher in self._publishers:
                if topic is IMAGE:
                    publisher.publish(encode_image(picture, header.stamp, 'eye'))
                elif topic is DETECTIONS:
                    publisher.publish(encode_detections(header, []))
            frame = self.node.frame
            return frame.picture is not None and frame.picture.stamp_ns in stamps

        self.spin_until(is_shown)

    def call(self, service_type: Any, name: str, request: Any) -> Any:
        client = self._speaker.create_client(service_type, name)
        self.spin_until(client.service_is_ready)
        future = client.call_async(request)
        self.spin_until(future.done)
        self._speaker.destroy_client(client)
        return future.result()

    def _keep_problems(self) -> None:
        record_problem = self.node.health.record_problem

        def keep(where: str, message: str, *args: Any, **kwargs: Any) -> bool:
            self.problems.append(message)
            return record_problem(where, message, *args, **kwargs)

        self.node.health.record_problem = keep

    def _is_heard(self) -> bool:
        heard = {topic.name for topic in self.node.subscribed_topics.values()}
        return all(
            publisher.get_subscription_count()
            for topic, publisher in self._publishers
            if topic.name in heard
        )

    def _tend(self) -> None:
        """Do what a browser does for the page, and draw all that it would show."""
        if isinstance(self.node, ViewNode):
            self.node.note_viewer()
            self.node.show_truth(True)
            frame = self.node.frame
            facts_html(frame.facts)
            nodes_html(frame.node_health, frame.latencies_ms)
            if frame.scene is not None:
                from_above(frame.scene)
                postures(frame.scene)
            if frame.picture is not None:
                frame.picture.jpeg()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        name = self.node.get_fully_qualified_name()
        self.reports += any(status.name == name for status in message.status)


@pytest.fixture
def attack(request, ros_context, needed):
    spec: NodeSpec = request.param
    parameters = {**PRESETS.get(spec.executable, {}), **needed.get(spec.executable, {})}
    spec = NodeSpec(spec.package, spec.executable, parameters)
    attack = _Attack(spec.load()(context=ros_context, cli_args=spec.ros_arguments()), ros_context)
    yield attack
    attack.close()


@pytest.mark.parametrize('attack', found_nodes(), ids=lambda spec: spec.executable, indirect=True)
def test_node_survives_malformed_and_foreign_messages(attack):
    node, sizes = attack.node, []
    sets = SETS_A_ROUND if node.subscribed_topics else FEW_SETS
    for number in range(ROUNDS):
        for count in range(sets):
            attack.publish_set(10**9 + (number * sets + count) * 10**8)
        sizes.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    for name, service in node.advertised_services.items():
        for _ in range(2):
            assert attack.call(service, name, malformed(service.Request, attack.rng)).message
    odd = [
        Parameter(name, value=attack.rng.choice(ODD_VALUES)).to_parameter_msg()
        for name in parameter_names(node)
        if name != 'use_sim_time'
    ]
    set_parameters = f'{node.get_fully_qualified_name()}/set_parameters'
    answer = attack.call(SetParameters, set_parameters, SetParameters.Request(parameters=odd))
    assert len(answer.results) == len(odd)
    before = attack.reports
    attack.spin_until(lambda: attack.reports > before)
    if isinstance(node, ViewNode):
        attack.show_good_image()
    values = node.health.report(0.0).values
    assert all(int(values[f'{name} received']) > 0 for name in node.subscribed_topics)
    assert sizes[2] - sizes[1] < 20_000, f'memory grows [kB]: {sizes}'
    # Odd input gives one clear sentence; a traceback would be a fault of the node.
    assert not [text for text in attack.problems if 'Traceback' in text]
