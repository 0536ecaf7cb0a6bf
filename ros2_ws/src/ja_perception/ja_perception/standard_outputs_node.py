"""`standard_outputs`: what was seen as vision_msgs, and people as in REP-155 (hri_msgs)."""

import os
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from ja_common.camera_input import CameraInput, CameraInputConfig
from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.detection import Detection, Kind
from ja_common.core.face_gaze import FaceGaze
from ja_common.core.health import Level
from ja_common.detection_codec import decode_detections
from ja_common.face_gaze_codec import decode_face_gaze
from ja_common.graph_node import GraphNode
from ja_common.image_codec import encode_image
from ja_common.node_main import spin_node
from ja_common.optional_types import how_to_install
from ja_common.point_cloud_codec import decode_columns
from ja_common.time_codec import to_ns
from ja_common.topics import (
    DETECTIONS,
    FACE_GAZE,
    FACE_LANDMARKS,
    IMAGE,
    IMAGE_COMPRESSED,
    Topic,
)
from ja_common.transforms import encode_tf, encode_transform, tf_topics
from ja_perception.standard_codec import (
    HriTypes,
    VisionTypes,
    crop_face_picture,
    encode_detections_2d,
    encode_landmarks,
    encode_region,
    face_id,
    face_position,
    face_rotation,
    gaze_rotation,
)

_QOS = QoSProfile(depth=10)
_MOST_WAITING = 8  # images whose detections have not come
_NICENESS = 10  # on a busy processor the graph comes first


@dataclass(frozen=True)
class StandardOutputsConfig(Configuration):
    """What it reads, and how the pictures of faces are."""

    compressed: bool = parameter(
        False, 'subscribe to image_raw/compressed, as of salient_feature_detector'
    )
    face_width_px: int = parameter(
        128, 'columns of /humans/faces/<id>/cropped [px]', low=8, high=2048
    )
    face_height_px: int = parameter(
        128, 'rows of /humans/faces/<id>/cropped [px]', low=8, high=2048
    )
    nominal_distance_m: float = parameter(
        1.0, 'where the frames of a face are whose range is not known [m]', low=0.05, high=100.0
    )
    topics_kept_s: float = parameter(
        5.0, 'time for which the topics of a face stay that is no longer seen [s]',
        low=0.0, high=3600.0,
    )  # fmt: skip


class StandardOutputsNode(GraphNode):
    """Converts each detections message once the picture and the gaze of its stamp have come.

    Raises ConfigError where neither vision_msgs nor hri_msgs is installed.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('standard_outputs', **node_kwargs)
        self._config = self.configure(StandardOutputsConfig)
        self._vision, self._hri = VisionTypes.find(), HriTypes.find()
        self._tf = self._make_tf()
        self._report_types()
        self._image_topic = IMAGE_COMPRESSED if self._config.compressed else IMAGE
        self._camera = CameraInput(
            self.configure(CameraInputConfig), self.resolve_topic_name(self._image_topic.name)
        )
        self._size: tuple[int, int] | None = None
        self._waiting: dict[int, dict[Topic, Any]] = {}
        self._faces: dict[str, _FaceTopics] = {}
        if self._vision is not None:
            self._detections = self.create_topic_publisher(
                Topic('detections_2d', self._vision.array, 'objects and faces', _QOS, _QOS)
            )
        if self._hri is not None:
            self._tracked = self.create_topic_publisher(
                Topic('/humans/faces/tracked', self._hri.ids, 'faces that are seen', _QOS, _QOS)
            )
        # In this order, so that what belongs to detections is there before them.
        topics = [self._image_topic, FACE_GAZE, FACE_LANDMARKS, DETECTIONS]
        for topic in topics:
            silent_after_s = 2.0 if topic in (self._image_topic, DETECTIONS) else None
            self.subscribe(topic, self._keeper_of(topic), silent_after_s)

    def _make_tf(self) -> Publisher | None:
        topics = tf_topics()
        if topics is None or self._hri is None:
            return None
        return self.create_topic_publisher(topics[0])

    def _report_types(self) -> None:
        """Log once what is published and what is missing, and show it in the diagnostics."""
        outputs = {
            'vision_msgs': (self._vision, 'detections_2d'),
            'hri_msgs': (self._hri, '/humans/faces'),
            'tf2_msgs': (self._tf, 'tf of face_<id> and gaze_<id>'),
        }
        published = [text for found, text in outputs.values() if found is not None]
        missing = {
            package: f'{text}: {package} is not installed ({how_to_install(package)})'
            for package, (found, text) in outputs.items()
            if found is None and not (package == 'tf2_msgs' and self._hri is None)
        }
        if self._vision is None and self._hri is None:
            raise ConfigError(
                'standard_outputs has nothing to publish: neither vision_msgs nor hri_msgs is '
                f'installed ({how_to_install("vision_msgs", "hri_msgs")})'
            )
        texts = [f'published: {", ".join(published)}']
        texts += [f'missing: {"; ".join(missing.values())}'] * bool(missing)
        self.get_logger().info('; '.join(texts))
        for package, (found, text) in outputs.items():
            self.health.values[package] = missing.get(package, text if found else 'not used')

    def _keeper_of(self, topic: Topic) -> Any:
        def keep(message: Any) -> None:
            stamp_ns = to_ns(message.header.stamp)
            # The newest last: a message that is sent again counts as new.
            parts = self._waiting.pop(stamp_ns, {})
            self._waiting[stamp_ns] = {**parts, topic: message}
            self._publish_ready()

        return keep

    def _publish_ready(self) -> None:
        """Publish the sets up to the newest complete one; what those before it lack was lost."""
        stamps = list(self._waiting)
        complete = [self._is_complete(self._waiting[stamp_ns]) for stamp_ns in stamps]
        newest = max((i + 1 for i, is_complete in enumerate(complete) if is_complete), default=0)
        for stamp_ns in stamps[: max(newest, len(stamps) - _MOST_WAITING)]:
            parts = self._waiting.pop(stamp_ns)
            if DETECTIONS in parts:
                self._publish(parts)

    def _is_complete(self, parts: dict[Topic, Any]) -> bool:
        if DETECTIONS not in parts or self._image_topic not in parts:
            return False
        return FACE_GAZE in parts or not _reads_gaze(parts[DETECTIONS])

    def _publish(self, parts: dict[Topic, Any]) -> None:
        message = parts[DETECTIONS]
        header, detections = message.header, decode_detections(message)
        namespace = self.get_namespace()
        if self._vision is not None:
            self._detections.publish(
                encode_detections_2d(self._vision, header, detections, namespace)
            )
        if self._hri is None:
            return
        faces = {face_id(each, namespace): each for each in detections if each.kind is Kind.FACE}
        for name in faces:
            if name not in self._faces:
                self._faces[name] = _FaceTopics(self, self._hri, name)
        # After the topics exist: a subscriber that reads the list looks for them at once.
        self._tracked.publish(self._hri.ids(header=header, ids=list(faces)))
        picture = self._picture(parts)
        for name, face in faces.items():
            self._publish_face(self._faces[name], header, face, picture)
            if face.gaze_read and FACE_GAZE in parts:
                self._publish_reading(self._faces[name], header, face, parts)
        self._remove_topics_of_others(faces)

    def _picture(self, parts: dict[Topic, Any]) -> NDArray[np.uint8] | None:
        """Return the upright picture, whose size holds for later ones that were lost."""
        if self._image_topic not in parts:
            text = f'{self._image_topic.name}: the picture of a detection did not come'
            self.report_problem('picture', text, Level.WARN)
            return None
        picture = self._camera.decode(parts[self._image_topic])
        self._size = (picture.shape[1], picture.shape[0])
        return picture

    def _publish_face(
        self,
        topics: '_FaceTopics',
        header: Header,
        face: Detection,
        picture: NDArray[np.uint8] | None,
    ) -> None:
        topics.seen_s = time.monotonic()
        if self._size is not None and self._hri is not None:
            topics.roi.publish(encode_region(self._hri, header, face, *self._size))
        if picture is not None and topics.cropped.get_subscription_count():
            config = self._config
            cropped = crop_face_picture(picture, face, config.face_width_px, config.face_height_px)
            topics.cropped.publish(encode_image(cropped, header.stamp, header.frame_id))

    def _publish_reading(
        self, topics: '_FaceTopics', header: Header, face: Detection, parts: dict[Topic, Any]
    ) -> None:
        """Publish what was read of the attended face: its frames and its landmarks."""
        if self._tf is not None:
            gaze = decode_face_gaze(parts[FACE_GAZE])
            self._tf.publish(encode_tf(self._frames(topics.name, header, face, gaze)))
        if FACE_LANDMARKS in parts and self._size is not None and self._hri is not None:
            columns = decode_columns(parts[FACE_LANDMARKS], ('u', 'v'))
            points = np.column_stack([columns['u'], columns['v']])
            topics.landmarks.publish(
                encode_landmarks(self._hri, header, points, face.score, *self._size)
            )

    def _frames(self, name: str, header: Header, face: Detection, gaze: FaceGaze) -> list[Any]:
        position = face_position(face, self._config.nominal_distance_m)
        return [
            encode_transform(header, f'face_{name}', face_rotation(face, gaze), position),
            encode_transform(header, f'gaze_{name}', gaze_rotation(face, gaze), position),
        ]

    def _remove_topics_of_others(self, seen: Collection[str]) -> None:
        """End the topics of the faces that have not been seen for long enough."""
        oldest_s = time.monotonic() - self._config.topics_kept_s
        for name in self._faces.keys() - seen:
            if self._faces[name].seen_s <= oldest_s:
                self._faces.pop(name).destroy()


class _FaceTopics:
    """The topics of one face."""

    def __init__(self, node: GraphNode, types: HriTypes, name: str) -> None:
        self.name = name
        self.seen_s = time.monotonic()
        self._node = node
        self._publishers: list[Publisher] = []
        self.roi = self._publisher(types.region, 'roi', 'where the face is in the picture')
        self.cropped = self._publisher(Image, 'cropped', 'picture of the face')
        self.landmarks = self._publisher(types.landmarks, 'landmarks', 'landmarks of the face')

    def destroy(self) -> None:
        """End the topics."""
        for publisher in self._publishers:
            self._node.published_topics.pop(publisher.topic_name, None)
            self._node.destroy_publisher(publisher)

    def _publisher(self, message_type: Any, what: str, purpose: str) -> Publisher:
        topic = Topic(f'/humans/faces/{self.name}/{what}', message_type, purpose, _QOS, _QOS)
        self._publishers.append(self._node.create_topic_publisher(topic))
        return self._publishers[-1]


def _reads_gaze(message: Any) -> bool:
    """Return whether a gaze belongs to the detections of a message that can be used."""
    try:
        return any(each.gaze_read for each in decode_detections(message))
    except ValueError:
        return False  # it is reported where it is used


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    os.nice(_NICENESS)
    spin_node(StandardOutputsNode, args)


if __name__ == '__main__':
    main()
