"""`markers`: shows what the head sees and does in RViz and Foxglove. It only subscribes."""

import math
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header

from ja_common.camera_input import CameraInput, CameraInputConfig
from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection
from ja_common.core.fixation import WIDTH_SIXTH
from ja_common.core.health import Level
from ja_common.core.posture import Posture
from ja_common.face_gaze_codec import decode_face_gaze
from ja_common.graph_node import GraphNode
from ja_common.head_description import BASE_FRAME
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.polled_subscription import PolledSubscription
from ja_common.posture_reader import PostureReader
from ja_common.time_codec import to_ns
from ja_common.topics import (
    BELIEF,
    CAMERA_INFO,
    DETECTIONS,
    FACE_GAZE,
    FIXATION,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    MARKERS,
    Topic,
)
from ja_dashboard.bounded_clouds import finite_columns, shown_detections
from ja_dashboard.core.gaze_view import GazeView
from ja_dashboard.core.markers import HeadScene, shapes_of
from ja_dashboard.marker_codec import encode_markers

_KEPT = 50  # messages from poll to poll
_DEPTHS = {
    **dict.fromkeys((CAMERA_INFO, BELIEF, FIXATION), 1),
    **dict.fromkeys((JOINT_STATES, DETECTIONS, FACE_GAZE, JOINT_COMMANDS), _KEPT),
}
_POSTURE_PATIENCE_S = 1.0
_NICENESS = 10  # on a busy processor the graph comes first

Taken = Mapping[Topic, list[tuple[Any, int]]]


@dataclass(frozen=True)
class MarkersConfig(Configuration):
    """Where and how often it is drawn."""

    base_frame: str = parameter(
        BASE_FRAME, 'frame of all markers: x forward at pan 0, the camera in its origin'
    )
    nominal_distance_m: float = parameter(
        1.0, 'where a direction ends of which no range is known [m]', low=0.05, high=100.0
    )
    d_th_rad: float = parameter(
        WIDTH_SIXTH, 'd_th of Eq. 3, as of internal_evaluator: radius of the circle',
        low=0.001, high=1.0,
    )  # fmt: skip
    highest_rate_hz: float = parameter(
        10.0, 'messages a second of wall time, at most', low=0.5, high=60.0
    )


class MarkersNode(GraphNode):
    """Draws the newest image whose posture is known; it listens only while `markers` is read.

    Its subscriptions wake no executor and are best effort, so the graph never waits for it.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('markers', **node_kwargs)
        self._config = self.configure(MarkersConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        self._camera_config = self.configure(CameraInputConfig)
        self._publisher = self.create_topic_publisher(MARKERS)
        self._feed: _Feed | None = None
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0 / self._config.highest_rate_hz, self._poll, clock=steady)

    def destroy_node(self) -> None:
        """Close the polled subscriptions, which the node does not know, then the node."""
        self._close_feed()
        super().destroy_node()

    @property
    def polled_subscriptions(self) -> Mapping[Topic, PolledSubscription]:
        """Return the current subscriptions, which do not wake the executor."""
        return {} if self._feed is None else self._feed.subscriptions

    def _poll(self) -> None:
        if not self._publisher.get_subscription_count():
            self._close_feed()
            return
        if self._feed is None:
            self._feed = _Feed(self, self._joints, self._camera_config)
        found = self._feed.poll_messages(time.monotonic())
        if found is not None:
            stamp, scene = found
            header = Header(stamp=stamp, frame_id=self._config.base_frame)
            shapes = shapes_of(scene, self._config.nominal_distance_m, self._config.d_th_rad)
            self._publisher.publish(encode_markers(header, shapes))

    def _close_feed(self) -> None:
        if self._feed is not None:
            self._feed.close()
            self._feed = None


class _Feed:
    """All that is drawn, polled from the graph; exists only while `markers` is read."""

    def __init__(self, node: GraphNode, joints: JointCodec, camera: CameraInputConfig) -> None:
        self._node, self._joints = node, joints
        self.subscriptions = {
            topic: PolledSubscription(node, topic, depth) for topic, depth in _DEPTHS.items()
        }
        self._camera = CameraInput(camera, node.resolve_topic_name(IMAGE.name))
        self._postures = PostureReader(joints)
        self._waiting: list[PointCloud2] = []
        self._waiting_since_s = math.inf
        self._gazes: list[PointCloud2] = []
        self._fixation: np.ndarray | None = None
        self._last_command = np.full(2, np.nan)
        self._belief = np.zeros((0, 3))

    def close(self) -> None:
        """Stop listening."""
        for subscription in self.subscriptions.values():
            subscription.close()
        self.subscriptions.clear()

    def poll_messages(self, now_s: float) -> tuple[Any, HeadScene] | None:
        """Return stamp and scene of the newest image that can be drawn; None without a new one."""
        taken = {topic: each.take_messages() for topic, each in self.subscriptions.items()}
        for topic, callback in (
            (CAMERA_INFO, self._camera.record_camera_info),
            (JOINT_STATES, self._record_joints),
            (JOINT_COMMANDS, self._record_command),
            (FIXATION, self._record_fixation),
            (BELIEF, self._record_belief),
        ):
            for message, _ in taken[topic]:
                self._node.call_guarded(topic.name, callback, message)
        self._waiting = [*self._waiting, *_messages(taken, DETECTIONS)][-_KEPT:]
        self._gazes = [*self._gazes, *_messages(taken, FACE_GAZE)][-_KEPT:]
        message = self._pop_newest(now_s)
        if message is None:
            return None
        detections = self._decoded(DETECTIONS, shown_detections, message)
        if detections is None:
            return None
        return message.header.stamp, self._scene(message, detections)

    def _pop_newest(self, now_s: float) -> PointCloud2 | None:
        """Return the newest detections whose posture is known; those after them still wait."""
        for index in reversed(range(len(self._waiting))):
            if self._posture_of(message := self._waiting[index]) is not None:
                del self._waiting[: index + 1]
                self._waiting_since_s = math.inf
                self._node.health.clear_problem('posture')
                return message
        if self._waiting:
            self._waiting_since_s = min(self._waiting_since_s, now_s)
        if now_s - self._waiting_since_s > _POSTURE_PATIENCE_S:
            why = self._postures.explain_unknown(to_ns(self._waiting[-1].header.stamp))
            text = f'nothing is drawn: no posture at the stamp of an image; {why}'
            self._node.report_problem('posture', text, Level.WARN)
        return None

    def _posture_of(self, message: PointCloud2) -> Posture | None:
        return self._postures.history.at(to_ns(message.header.stamp))

    def _scene(self, message: PointCloud2, detections: list[Detection]) -> HeadScene:
        posture = self._posture_of(message)
        assert posture is not None
        gazes = [each for each in self._gazes if each.header.stamp == message.header.stamp]
        read = self._decoded(FACE_GAZE, decode_face_gaze, gazes[-1]) if gazes else None
        commanded = bool(np.isfinite(self._last_command).all())  # each joint has been
        return HeadScene(
            posture=posture.position,
            detections=detections,
            camera=self._decoded(CAMERA_INFO, lambda _: self._camera.full_view(), None),
            gaze=GazeView(gaze=read).direction,
            fixation=self._fixation,
            command=self._last_command if commanded else None,
            belief=self._belief,
        )

    def _record_joints(self, message: JointState) -> None:
        now_s = time.monotonic()
        try:
            self._postures.record_message(message, now_s)
        finally:
            self._postures.report_joints(self._node, now_s)

    def _record_command(self, message: JointState) -> None:
        self._last_command = self._joints.decode_command(message, self._last_command)

    def _record_fixation(self, message: JointState) -> None:
        self._fixation = self._joints.decode(message)

    def _record_belief(self, message: PointCloud2) -> None:
        columns = finite_columns(message, ('pan', 'tilt', 'weight'))
        self._belief = np.column_stack(list(columns.values())).astype(float)

    def _decoded(self, topic: Topic, decode: Callable[[Any], Any], message: Any) -> Any:
        """Return what `decode` makes of a message; None and a problem where it raises."""
        decoded: list[Any] = []
        self._node.call_guarded(topic.name, lambda: decoded.append(decode(message)))
        return decoded[0] if decoded else None


def _messages(taken: Taken, topic: Topic) -> list[Any]:
    return [message for message, _ in taken[topic]]


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    os.nice(_NICENESS)
    spin_node(MarkersNode, args)


if __name__ == '__main__':
    main()
