"""`python -m ja_diagnostics.faults.intruder SECONDS`: what an uninvited host can do.

It looks for all nodes that ROS_STATIC_PEERS and ROS_AUTOMATIC_DISCOVERY_RANGE lead to, and asks
each service `gate/enable` that it finds to hold the head.
"""

import json
import sys
import time

from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import SetBool

from ja_common.private_context import private_executor
from ja_common.ros_defaults import apply_ros_defaults

_TYPE = 'std_srvs/srv/SetBool'


def try_to_enter(for_s: float) -> dict[str, list[str]]:
    """Try until a node is found and a service obeys, for so many seconds at most.

    Returns the `nodes` found, and the services that `obeyed`.
    """
    with private_executor() as executor:
        node = Node('intruder', context=executor.context)
        executor.add_node(node)
        nodes: set[str] = set()
        clients: dict[str, Client] = {}
        answers: dict[str, Future] = {}
        obeyed: list[str] = []
        end_s = time.monotonic() + for_s
        # A name may come after the endpoints of its node.
        while not (nodes and obeyed) and time.monotonic() < end_s:
            executor.spin_once(timeout_sec=0.1)
            nodes |= set(node.get_node_names()) - {node.get_name()}
            for name, types in node.get_service_names_and_types():
                if name.endswith('/gate/enable') and _TYPE in types and name not in clients:
                    clients[name] = node.create_client(SetBool, name)
            for name, client in clients.items():
                if name not in answers and client.service_is_ready():
                    answers[name] = client.call_async(SetBool.Request(data=False))
            obeyed = sorted(name for name, answer in answers.items() if answer.done())
        return {'nodes': sorted(nodes), 'obeyed': obeyed}


def main() -> None:
    """Try, and print as one line of JSON what came of it."""
    apply_ros_defaults()
    print(json.dumps(try_to_enter(float(sys.argv[1]))), flush=True)


if __name__ == '__main__':
    main()
