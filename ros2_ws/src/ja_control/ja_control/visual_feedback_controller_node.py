"""`visual_feedback_controller`: detections in, changes of posture out (Eq. 2)."""

from typing import Any

from sensor_msgs.msg import PointCloud2

from ja_common.core.detection import Detection, caregiver_face, most_salient
from ja_common.detection_codec import decode_detections
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.topics import DETECTIONS, FACE_DELTA, VF_DELTA
from ja_control.core.visual_feedback import VisualFeedbackConfig, visual_feedback


class VisualFeedbackControllerNode(GraphNode):
    """Proposes to centre the most salient object, and to centre the caregiver's face."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('visual_feedback_controller', **node_kwargs)
        self._config = self.configure(VisualFeedbackConfig, self._reconfigure)
        self._joints = JointCodec(self.configure(JointConfig))
        self.subscribe(DETECTIONS, self._on_detections, expected_every_s=2.0)
        self._target_delta = self.create_topic_publisher(VF_DELTA)
        self._face_delta = self.create_topic_publisher(FACE_DELTA)

    def _reconfigure(self, config: VisualFeedbackConfig) -> None:
        self._config = config

    def _on_detections(self, message: PointCloud2) -> None:
        detections = decode_detections(message)
        for publisher, detection in (
            (self._target_delta, most_salient(detections)),
            (self._face_delta, caregiver_face(detections)),
        ):
            publisher.publish(self._joints.encode(message.header, self._delta(detection)))

    def _delta(self, detection: Detection | None) -> Any:
        return None if detection is None else visual_feedback(detection.ray, self._config.gain)


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(VisualFeedbackControllerNode, args)


if __name__ == '__main__':
    main()
