"""`internal_evaluator`: detections in, the fixated object's direction out (Eq. 3)."""

from typing import Any

from ja_common.detection_codec import decode_detections
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.topics import DETECTIONS, FIXATION
from ja_learning.core.evaluator import EvaluatorConfig, InternalEvaluator


class InternalEvaluatorNode(GraphNode):
    """The node of Eq. 3: one fixation an image. It does not know the attended object."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('internal_evaluator', **node_kwargs)
        self._joints = JointCodec(self.configure(JointConfig))
        self._evaluator = InternalEvaluator(self.configure(EvaluatorConfig, self._reconfigure))
        synchroniser = Synchroniser(self, self._joints)
        synchroniser.call_with({DETECTIONS: decode_detections}, self._evaluate)
        self._fixation = self.create_topic_publisher(FIXATION)

    def _reconfigure(self, config: EvaluatorConfig) -> None:
        self._evaluator.config = config

    def _evaluate(self, found: StampedSet) -> None:
        fixation = self._evaluator.find_fixation(found[DETECTIONS], found.posture)
        self._fixation.publish(self._joints.encode(found.header, fixation))


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(InternalEvaluatorNode, args)


if __name__ == '__main__':
    main()
