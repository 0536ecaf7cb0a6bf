"""salient_feature_detector: image in, faces and salient objects out (Eq. 1), stamp unchanged."""

import math
import time
from collections.abc import Sequence
from dataclasses import Field, dataclass, fields, replace
from typing import Any

import cv2
import numpy as np
from geometry_msgs.msg import Point, PointStamped
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from ja_common.camera_input import CameraInput, CameraInputConfig
from ja_common.core.annotate import annotate_image
from ja_common.core.camera_model import CameraModel
from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.detection import Detection, caregiver_face
from ja_common.core.health import Level
from ja_common.core.picture_watch import PictureWatch
from ja_common.core.weight_files import note_weight_files
from ja_common.detection_codec import encode_detections
from ja_common.face_gaze_codec import encode_face_gaze
from ja_common.graph_node import GraphNode
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.point_cloud_codec import encode_columns
from ja_common.renamed_publisher import RenamedPublisher
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.topics import (
    CAMERA_INFO,
    DETECTIONS,
    FACE,
    FACE_GAZE,
    FACE_IMAGE,
    FACE_LANDMARKS,
    IMAGE,
    IMAGE_ANNOTATED,
    IMAGE_COMPRESSED,
    OLD_FACE,
    OLD_TARGET,
    TARGET,
    WEIGHT_FILES,
)
from ja_common.weight_files_codec import encode_weight_files
from ja_perception.core.detector import DetectorConfig, Percept, SalientFeatureDetector
from ja_perception.core.face_finders import FACE_FINDERS
from ja_perception.core.face_tracking import PeopleSeen
from ja_perception.core.gaze_reader import GazeReader
from ja_perception.range_input import RangeConfig, RangeInput


@dataclass(frozen=True)
class InputConfig(Configuration):
    """What the node subscribes to, and how long it waits for it."""

    face_finder: str = parameter(
        'blazeface', 'how faces are found: a network, a cascade, or the template of the paper',
        choices=tuple(FACE_FINDERS),
    )  # fmt: skip
    read_gaze: bool = parameter(
        False, 'publish head pose and eyes of the attended face (face_gaze), by landmarks'
    )
    compressed: bool = parameter(False, 'subscribe to image_raw/compressed instead of image_raw')
    field_of_view_rad: float = parameter(
        math.radians(36), 'horizontal view of a camera that sends no calibration',
        low=0.01, high=3.0,
    )  # fmt: skip
    silent_after_s: float = parameter(2.0, 'time without images after which to warn', low=0.1)
    frozen_after_s: float = parameter(
        10.0, 'time of identical images after which to warn; 0: never', low=0.0, high=3600.0
    )
    posture_wait_s: float = parameter(
        1.0, 'longest time that an image waits for the posture at its stamp', low=0.0, high=60.0
    )


class SalientFeatureDetectorNode(GraphNode):
    """One detections message for every image, also when nothing is seen."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('salient_feature_detector', **node_kwargs)
        # One image at a time on one core: threads only wait for each other at these sizes.
        cv2.setNumThreads(1)
        self._input = self.configure(InputConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        with note_weight_files() as weight_files:
            self._finder = FACE_FINDERS[self._input.face_finder]()
            self._gaze_reader = self._make_gaze_reader()
        self._config = DetectorConfig(
            **{part.name: self._tunable(part) for part in fields(DetectorConfig)}
        )
        self._detector = self._make_detector()
        self._newest_percept: tuple[int, Percept] | None = None
        self._caregivers = 0
        self._image_topic = IMAGE_COMPRESSED if self._input.compressed else IMAGE
        self._camera = CameraInput(
            self.configure(CameraInputConfig), self.resolve_topic_name(self._image_topic.name)
        )
        self._watch = PictureWatch(self._input.frozen_after_s)
        silent_after_s = self._input.silent_after_s
        self._synchroniser = Synchroniser(
            self,
            self._joints,
            joints_expected_every_s=silent_after_s,
            patience_s=self._input.posture_wait_s,
            is_calibrated=lambda: self._camera.has_calibration,
            must_wait=lambda stamp_ns, waited_s: self._ranges.must_wait(stamp_ns, waited_s),
        )
        self._ranges = RangeInput(
            self,
            self.configure(RangeConfig),
            self._camera,
            self._synchroniser.call_ready,
            silent_after_s,
        )

        self._detections_publisher = self.create_topic_publisher(DETECTIONS)
        self._target_publisher = RenamedPublisher(self, TARGET, OLD_TARGET)
        self._face_publisher = RenamedPublisher(self, FACE, OLD_FACE)
        self._face_image_publisher = self.create_topic_publisher(FACE_IMAGE)
        self._face_gaze_publisher = self.create_topic_publisher(FACE_GAZE)
        self._landmarks_publisher = self.create_topic_publisher(FACE_LANDMARKS)
        self._annotated_publisher = self.create_topic_publisher(IMAGE_ANNOTATED)
        self._weight_files_publisher = self.create_topic_publisher(WEIGHT_FILES)
        self._weight_files_publisher.publish(
            encode_weight_files(self.get_fully_qualified_name(), weight_files)
        )
        self.subscribe(CAMERA_INFO, self._on_camera_info, silent_after_s)
        self._synchroniser.call_with(
            {self._image_topic: lambda message: message},
            self._detect,
            expected_every_s=silent_after_s,
        )

    def _tunable(self, part: Field) -> Any:
        """Declare a part of the configuration that may change; the detector then restarts."""

        def changed(config: Any) -> None:
            self._config = replace(self._config, **{part.name: config})
            self._detector = self._make_detector()
            self._newest_percept = None

        return self.configure(part.default_factory, changed)  # type: ignore[arg-type]

    def _make_detector(self) -> SalientFeatureDetector:
        return SalientFeatureDetector(self._finder, self._config, self._gaze_reader)

    def _make_gaze_reader(self) -> GazeReader | None:
        """Return the reader of gaze; None, with a problem reported, if OpenCV cannot run it."""
        self._no_gaze_because = ''
        if self._input.read_gaze:
            try:
                return GazeReader()
            except ConfigError as error:
                self._no_gaze_because = str(error)
                self.report_problem('gaze', self._no_gaze_because, Level.WARN)
        return None

    def _on_camera_info(self, message: CameraInfo) -> None:
        self._camera.record_camera_info(message)
        self._synchroniser.call_ready()

    def _detect(self, found: StampedSet) -> None:
        message, stamp_ns, posture = (
            found[self._image_topic],
            found.stamp_ns,
            found.posture_or_none,
        )
        if posture is None:
            self.report_problem(
                'posture',
                'no joint state for the stamp of the image: the camera is taken to stand '
                'still, and no face counts as attended',
                Level.WARN,
            )
        if self._no_gaze_because:
            self.report_problem('gaze', self._no_gaze_because, Level.WARN)
        start = time.perf_counter()
        image = self._camera.decode(message)
        camera = self._camera_of(image)
        if self._newest_percept is None or self._newest_percept[0] != stamp_ns:
            if problem := self._watch.record_picture(image, time.monotonic()):
                self.report_problem('picture', problem, Level.WARN)
            depth = self._ranges.sensor_at(stamp_ns, message.header.frame_id, image, camera)
            self._newest_percept = (
                stamp_ns,
                self._detector.detect(image, stamp_ns, camera, posture, depth),
            )
        # The same image again (a sim that lost the answer): the same answer again.
        percept = self._newest_percept[1]
        header = self._camera.upright_header(message.header)
        self._publish_percept(header, percept)
        self._report_people(percept.people)
        seconds = time.perf_counter() - start
        self.health.values['time an image [ms]'] = f'{1000 * seconds:.2f}'
        if self._ranges.is_chosen:
            known = sum(math.isfinite(each.range_m) for each in percept.detections)
            self.health.values['detections with a range'] = f'{known} of {len(percept.detections)}'
            self._ranges.record_known(known, len(percept.detections))
        if self._annotated_publisher.get_subscription_count():
            self._publish_annotated(header, image, percept, camera, seconds)

    def _report_people(self, people: PeopleSeen) -> None:
        self.health.values['people'] = people.describe()
        if people.caregivers > max(self._caregivers, 1):
            self.get_logger().info('another person is the caregiver now: she was gone for long')
        self._caregivers = people.caregivers

    def _publish_percept(self, header: Header, percept: Percept) -> None:
        # Face image and gaze go first: a node that reads `attended`, `gaze_read` can rely on them.
        if percept.face_image is not None:
            self._face_image_publisher.publish(
                encode_image(percept.face_image, header.stamp, header.frame_id)
            )
        if (reading := percept.gaze_reading) is not None:
            self._face_gaze_publisher.publish(encode_face_gaze(header, reading.gaze))
            if self._landmarks_publisher.get_subscription_count():
                u, v = reading.landmarks.T
                self._landmarks_publisher.publish(encode_columns(header, {'u': u, 'v': v}))
        self._detections_publisher.publish(encode_detections(header, percept.detections))
        # For displays only: mostly no node subscribes.
        for publisher, detection in (
            (self._target_publisher, percept.target),
            (self._face_publisher, caregiver_face(percept.detections)),
        ):
            if detection is not None and publisher.is_subscribed:
                publisher.publish(_point(header, detection))

    def _publish_annotated(
        self,
        header: Header,
        image: NDArray[np.uint8],
        percept: Percept,
        camera: CameraModel,
        seconds: float,
    ) -> None:
        d_th_rad = self._config.attention.d_th_rad
        drawn = annotate_image(
            image,
            percept.other_faces + percept.detections,
            percept.face_image,
            camera,
            d_th_rad,
            seconds,
        )
        self._annotated_publisher.publish(encode_image(drawn, header.stamp, header.frame_id))

    def _camera_of(self, image: NDArray[np.uint8]) -> CameraModel:
        """Return the calibrated camera for images of this size, or an ideal one."""
        camera = self._camera.camera(image)
        if camera is not None:
            return camera
        field_of_view_rad = self._input.field_of_view_rad
        self.report_problem(
            'calibration',
            'the camera is not calibrated: a horizontal view of '
            f'{math.degrees(field_of_view_rad):.0f} degrees is assumed (field_of_view_rad)',
            Level.WARN,
        )
        height, width = image.shape[:2]
        return CameraModel.from_field_of_view(width, height, field_of_view_rad)


def _point(header: Header, detection: Detection) -> PointStamped:
    return PointStamped(header=header, point=Point(x=detection.x, y=detection.y, z=1.0))


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    spin_node(SalientFeatureDetectorNode, args)


if __name__ == '__main__':
    main()
