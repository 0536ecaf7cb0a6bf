"""An object and a face, and the messages of an image in which they are seen."""

import numpy as np

from ja_common.core.detection import Detection, Kind
from ja_common.core.face_gaze import FaceGaze
from ja_common.detection_codec import encode_detections
from ja_common.face_gaze_codec import encode_face_gaze
from ja_common.image_codec import encode_image
from ja_common.point_cloud_codec import encode_columns
from ja_common.topics import DETECTIONS, FACE_GAZE, FACE_LANDMARKS, IMAGE
from ja_perception.standard_codec import MESH_POINTS
from node_bench import NodeBench, header

PERIOD_NS = 10**8
BALL = Detection(Kind.OBJECT, 0.1, -0.2, 20.5, 99.0, 8.0, 9.0, 0.5, 12)
FACE = Detection(Kind.FACE, 0.0, 0.1, 40.0, 30.0, 20.0, 24.0, 0.9, 3)
READ = FACE._replace(gaze_read=True)
GAZE = FaceGaze(np.zeros(3), 0.03, np.zeros((2, 2)), 0.04)
IN = [IMAGE, FACE_GAZE, FACE_LANDMARKS, DETECTIONS]


def publish(
    bench: NodeBench,
    index: int,
    detections: list[Detection],
    image: bool = True,
    reading: bool = False,
    landmarks: bool = True,
) -> None:
    """Publish what belongs to an image, in the order of the detector."""
    head = header(index * PERIOD_NS, 'camera_optical_frame')
    if image:
        picture = np.full((60, 80, 3), 200, np.uint8)
        bench.publish(IMAGE, encode_image(picture, head.stamp, head.frame_id))
    if reading:
        bench.publish(FACE_GAZE, encode_face_gaze(head, GAZE))
        if landmarks:
            mesh = {axis: np.full(MESH_POINTS, 10.0) for axis in ('u', 'v')}
            bench.publish(FACE_LANDMARKS, encode_columns(head, mesh))
    bench.publish(DETECTIONS, encode_detections(head, detections))
