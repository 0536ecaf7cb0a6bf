"""`internal_evaluator`: detections in, the fixated object's direction out (Eq. 3)."""

from functools import partial
from typing import Any

from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from ja_common.core.detection import Detection
from ja_common.core.posture import Posture
from ja_common.detection_codec import decode_detections
from ja_common.graph_node import GraphNode, spin_node
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.posture_listener import PostureListener
from ja_common.time_codec import to_ns
from ja_common.topics import DETECTIONS, FIXATION
from ja_learning.core.evaluator import EvaluatorConfig, InternalEvaluator


class InternalEvaluatorNode(GraphNode):
    """Says for every image whether an object is fixated; nobody tells it which was meant."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('internal_evaluator', **node_kwargs)
        self._joints = JointCodec(self.configure(JointConfig))
        self._evaluator = InternalEvaluator(self.configure(EvaluatorConfig, self._reconfigure))
        self._postures = PostureListener(self, self._joints)
        self.subscribe(DETECTIONS, self._on_detections, expected_every_s=2.0)
        self._fixation = self.create_topic_publisher(FIXATION)

    def _reconfigure(self, config: EvaluatorConfig) -> None:
        self._evaluator.config = config

    def _on_detections(self, message: PointCloud2) -> None:
        detections = decode_detections(message)
        evaluate = partial(self._evaluate, message.header, detections)
        self._postures.when_known(to_ns(message.header.stamp), evaluate)

    def _evaluate(self, header: Header, detections: list[Detection], posture: Posture) -> None:
        fixation = self._evaluator.fixation(detections, posture)
        self._fixation.publish(self._joints.encode(header, fixation))


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(InternalEvaluatorNode, args)


if __name__ == '__main__':
    main()
