"""Images with their detections, polled from the graph while the page has a viewer."""

import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2

from ja_common.camera_input import CameraInput, CameraInputConfig
from ja_common.core.annotate import annotate_image
from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection
from ja_common.core.fixation import WIDTH_SIXTH
from ja_common.core.geometry import directions_of_rays
from ja_common.face_gaze_codec import decode_face_gaze
from ja_common.graph_node import GraphNode
from ja_common.image_codec import decode_image
from ja_common.joint_codec import JointCodec
from ja_common.polled_subscription import PolledSubscription
from ja_common.posture_reader import PostureReader
from ja_common.time_codec import to_ns
from ja_common.topics import (
    BELIEF,
    CAMERA_INFO,
    DETECTIONS,
    FACE_GAZE,
    FACE_IMAGE,
    FACE_LANDMARKS,
    FIXATION,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    LM_DELTA,
    SIM_TRUTH,
    VF_DELTA,
    Topic,
)
from ja_dashboard.bounded_clouds import finite_columns, shown_detections
from ja_dashboard.core.gaze_view import GazeView, draw_gaze
from ja_dashboard.core.view_model import SceneView, TruthView, ViewModel

MESSAGES_PER_POLL = 50
"""Messages kept from poll to poll: enough for 500 images and ten polls a second."""
_DEPTHS = {
    **dict.fromkeys((IMAGE, CAMERA_INFO, BELIEF), 1),
    **dict.fromkeys(
        (JOINT_STATES, DETECTIONS, FACE_IMAGE, VF_DELTA, LM_DELTA, JOINT_COMMANDS),
        MESSAGES_PER_POLL,
    ),
}
_OPTIONAL = (FACE_GAZE, FACE_LANDMARKS)
"""Topics of senses that most graphs lack: subscribed once they have a publisher."""
_LOOK_FOR_SENSES_EVERY_S = 1.0
_STEPS = (DETECTIONS, VF_DELTA, LM_DELTA, FIXATION, JOINT_COMMANDS)
"""The topics that follow from an image, in their order."""
_ASSUMED_VIEW_RAD = math.radians(36)
_JPEG_QUALITY = 80
_MOST_PX = 8192
_PLAIN_WIDTH = 1280
_RECENT = 4
"""Pictures that a browser may still ask for by their stamps."""
LIMITS = ('pan_min_rad', 'tilt_min_rad', 'pan_max_rad', 'tilt_max_rad')
"""The gate's parameters, in the order of (low, high)."""


@dataclass(frozen=True)
class Picture:
    """One image (H, W, 3) RGB with its detections."""

    stamp_ns: int
    image: NDArray[np.uint8]
    detections: list[Detection]
    face_image: NDArray[np.uint8] | None
    camera: CameraModel
    latency_s: float
    gaze: GazeView = field(default_factory=GazeView)

    def jpeg(self) -> bytes:
        """Return the image as JPEG with boxes, centre circle, face crop, landmarks and gaze."""
        drawn = annotate_image(
            self.image, self.detections, self.face_image, self.camera, WIDTH_SIXTH, self.latency_s
        )
        scale = drawn.shape[1] / self.image.shape[1]
        draw_gaze(drawn, self.gaze, self.detections, scale)
        return _jpeg(drawn)

    def plain_jpeg(self) -> bytes:
        """Return the image as JPEG with nothing drawn into it, at most 1280 pixels wide."""
        height, width = self.image.shape[:2]
        shown = self.image
        if width > _PLAIN_WIDTH:
            size = (_PLAIN_WIDTH, max(1, round(height * _PLAIN_WIDTH / width)))
            shown = cv2.resize(shown, size, interpolation=cv2.INTER_AREA)
        return _jpeg(shown)


class ImageFeed:
    """All topics that come once an image; exists only while the page has a viewer.

    A message that cannot be shown is a problem of the node; all others are shown.
    """

    def __init__(
        self, node: GraphNode, model: ViewModel, joints: JointCodec, camera: CameraInputConfig
    ) -> None:
        self._node = node
        self._model = model
        self._joints = joints
        self.subscriptions = {
            topic: PolledSubscription(node, topic, depth) for topic, depth in _DEPTHS.items()
        }
        self._postures = PostureReader(joints)
        self._pending: tuple[int, Any] | None = None
        self._sent_ns: dict[int, int] = {}
        self._camera = CameraInput(camera, node.resolve_topic_name(IMAGE.name))
        self._last_command = np.full(2, np.nan)
        self._command: NDArray[np.float64] | None = None
        self._belief = np.zeros((0, 3))
        self._truth: TruthView | None = None
        self._looked_for_senses_s = -math.inf
        self.limits = np.radians([[-60.0, -35.0], [60.0, 35.0]])
        self.recent: deque[Picture] = deque(maxlen=_RECENT)
        self.scene: SceneView | None = None
        self.latencies_ms: dict[str, float] = {}

    @property
    def picture(self) -> Picture | None:
        """Return the newest picture."""
        return self.recent[-1] if self.recent else None

    def close(self) -> None:
        """Stop listening."""
        for subscription in self.subscriptions.values():
            subscription.close()
        self.subscriptions.clear()

    def show_truth(self, shown: bool) -> None:
        """Subscribe to the truth of the simulation, or stop; else only the scorer receives it."""
        if shown and SIM_TRUTH not in self.subscriptions:
            self.subscriptions[SIM_TRUTH] = PolledSubscription(self._node, SIM_TRUTH, 1)
        elif not shown and SIM_TRUTH in self.subscriptions:
            self.subscriptions.pop(SIM_TRUTH).close()
            self._truth = None

    def poll_messages(self, now_s: float, fixations: list[tuple[JointState, int]]) -> None:
        """Take the new messages; `fixations` come from the subscription of the node.

        An image is shown once its detections have come.
        """
        self._subscribe_senses(now_s)
        taken = {
            topic: subscription.take_messages()
            for topic, subscription in self.subscriptions.items()
        } | {FIXATION: fixations}
        self._measure_latencies(taken)
        for topic, callback in (
            (CAMERA_INFO, self._on_camera_info),
            (JOINT_STATES, self._on_joint_state),
            (JOINT_COMMANDS, self._on_command),
            (BELIEF, self._on_belief),
            (SIM_TRUTH, self._on_truth),
        ):
            for message, _ in taken.get(topic, []):
                self._node.call_guarded(topic.name, callback, message)
        self._show_images(now_s, taken)
        if self.scene is not None:
            self.scene = replace(
                self.scene, command=self._command, belief=self._belief, truth=self._truth
            )

    def _subscribe_senses(self, now_s: float) -> None:
        """Subscribe to the topics of the senses that this graph has, and leave those it lost."""
        if now_s - self._looked_for_senses_s < _LOOK_FOR_SENSES_EVERY_S:
            return
        self._looked_for_senses_s = now_s
        for topic in _OPTIONAL:
            exists = self._node.count_publishers(topic.name) > 0
            if exists and topic not in self.subscriptions:
                subscription = PolledSubscription(self._node, topic, MESSAGES_PER_POLL)
                self.subscriptions[topic] = subscription
            elif not exists and topic in self.subscriptions:
                self.subscriptions.pop(topic).close()

    def _measure_latencies(self, taken: Mapping[Topic, list[tuple[Any, int]]]) -> None:
        """Measure how long after an image each node published its result."""
        for message, sent_ns in taken[IMAGE]:
            self._sent_ns[to_ns(message.header.stamp)] = sent_ns
        while len(self._sent_ns) > 3:
            self._sent_ns.pop(next(iter(self._sent_ns)))
        for topic in _STEPS:
            for message, sent_ns in taken[topic]:
                image_ns = self._sent_ns.get(to_ns(message.header.stamp))
                if image_ns is not None:
                    self.latencies_ms[topic.name] = (sent_ns - image_ns) / 1e6

    def _on_camera_info(self, message: CameraInfo) -> None:
        self._camera.record_camera_info(message)

    def _on_joint_state(self, message: JointState) -> None:
        now_s = time.monotonic()
        try:
            self._postures.record_message(message, now_s)
        finally:
            self._postures.report_joints(self._node, now_s)

    def _on_command(self, message: JointState) -> None:
        self._last_command = self._joints.decode_command(message, self._last_command)
        if np.isfinite(self._last_command).all():  # each joint has been commanded
            self._command = self._last_command

    def _on_belief(self, message: PointCloud2) -> None:
        columns = finite_columns(message, ('pan', 'tilt', 'weight'))
        self._belief = np.column_stack(list(columns.values())).astype(float)

    def _on_truth(self, message: PointCloud2) -> None:
        c = finite_columns(message, ('x', 'y', 'z', 'pan', 'tilt', 'attended'))
        attended = np.flatnonzero(c['attended'])
        self._truth = TruthView(
            np.column_stack([c['x'], c['y'], c['z']]).astype(float),
            np.column_stack([c['pan'], c['tilt']]).astype(float),
            int(attended[0]) if len(attended) else -1,
        )

    def _show_images(self, now_s: float, taken: Mapping[Topic, list[tuple[Any, int]]]) -> None:
        found = {to_ns(message.header.stamp): message for message, _ in taken[DETECTIONS]}
        faces, gazes, landmarks = (
            {to_ns(message.header.stamp): message for message, _ in taken.get(topic, [])}
            for topic in (FACE_IMAGE, *_OPTIONAL)
        )
        pending = [] if self._pending is None else [self._pending]
        for message, _ in taken[IMAGE]:
            stamp_ns = to_ns(message.header.stamp)
            self._model.record_image(stamp_ns, now_s)
            pending.append((stamp_ns, message))
        for stamp_ns, message in pending:
            self._pending = (stamp_ns, message)
            if stamp_ns in found:
                self._pending = None
                detections, face = found[stamp_ns], faces.get(stamp_ns)
                gaze = self._gaze_view(gazes.get(stamp_ns), landmarks.get(stamp_ns))
                self._node.call_guarded(
                    IMAGE.name, self._show, stamp_ns, message, detections, face, gaze
                )

    def _gaze_view(self, gaze: Any, landmarks: Any) -> GazeView:
        points = None
        if landmarks is not None:
            points = self._decoded(FACE_LANDMARKS, _shown_points, landmarks)
        read = None if gaze is None else self._decoded(FACE_GAZE, decode_face_gaze, gaze)
        return GazeView(np.zeros((0, 2)) if points is None else points, read)

    def _show(
        self, stamp_ns: int, message: Any, found: PointCloud2, face: Any, gaze: GazeView
    ) -> None:
        _check_size(message)
        image = self._camera.decode(message)
        detections: list[Detection] = self._decoded(DETECTIONS, shown_detections, found) or []
        face_image = None if face is None else self._decoded(FACE_IMAGE, _shown_image, face)
        camera = self._camera_of(image)
        latency_s = self.latencies_ms.get(DETECTIONS.name, 0.0) / 1e3
        sample = self._postures.history.at(stamp_ns) or self._postures.history.newest
        posture = None if sample is None else sample.position
        rays = np.array([detection.ray for detection in detections]).reshape(-1, 2)
        self.scene = SceneView(
            half_view=camera.half_view_rad,
            low=self.limits[0],
            high=self.limits[1],
            posture=posture,
            detections=detections if posture is not None else [],
            directions=np.zeros((0, 2)) if posture is None else directions_of_rays(posture, rays),
            gaze=gaze.direction,
        )  # fmt: skip
        grey = None if face_image is None else face_image[..., 0]
        self.recent.append(Picture(stamp_ns, image, detections, grey, camera, latency_s, gaze))

    def _decoded(self, topic: Topic, decode: Callable[[Any], Any], message: Any) -> Any:
        """Return what `decode` makes of a message; None and a problem where it raises."""
        decoded: list[Any] = []
        self._node.call_guarded(topic.name, lambda: decoded.append(decode(message)))
        return decoded[0] if decoded else None

    def _camera_of(self, image: NDArray[np.uint8]) -> CameraModel:
        """Return the camera of an upright image (H, W, 3); an assumed one without a calibration.

        A calibration for images of another shape is a problem, but no reason to show no image.
        """
        height, width = image.shape[:2]
        camera = self._decoded(CAMERA_INFO, self._camera.camera, image)
        return camera or CameraModel.from_field_of_view(width, height, _ASSUMED_VIEW_RAD)


def _jpeg(image: NDArray[np.uint8]) -> bytes:
    quality = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
    return cv2.imencode('.jpg', cv2.cvtColor(image, cv2.COLOR_RGB2BGR), quality)[1].tobytes()


def _shown_image(message: Image) -> NDArray[np.uint8]:
    _check_size(message)
    return decode_image(message)


def _check_size(message: Image) -> None:
    """Raise ValueError for an image that no JPEG can hold and no browser can show."""
    if max(message.width, message.height) > _MOST_PX:
        raise ValueError(
            f'an image of {message.width}x{message.height} is too large for the page, which shows '
            f'up to {_MOST_PX} pixels a side'
        )


def _shown_points(message: PointCloud2) -> NDArray[np.float64]:
    return np.column_stack(list(finite_columns(message, ('u', 'v')).values())).astype(float)
