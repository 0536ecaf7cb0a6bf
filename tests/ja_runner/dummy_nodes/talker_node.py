"""`talker`: publishes a parameter's value; `crash` ends the process, `hang` never returns."""

import os
import sys
from typing import Any

from rclpy.node import Node
from std_msgs.msg import String

from ja_common.core.config import ConfigError
from ja_common.node_main import spin_node


class TalkerNode(Node):
    """Publishes its parameter `text` and its name."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('talker', **node_kwargs)
        self.text = self.declare_parameter('text', 'hello').value
        if self.text == 'bad':
            raise ConfigError('talker: parameter text = bad cannot be used')
        self.pub = self.create_publisher(String, 'chatter', 10)
        self.create_timer(0.02, self.publish_text)

    def publish_text(self) -> None:
        if self.text == 'crash':
            print('[ERROR] [talker]: the wheel came off', file=sys.stderr, flush=True)
            os._exit(7)
        while self.text == 'hang':
            pass
        self.pub.publish(String(data=f'{self.text} from {self.get_fully_qualified_name()}'))


def main(args: list[str] | None = None) -> None:
    """Run the node until a signal."""
    spin_node(TalkerNode, args)
