"""A host that names ours in ROS_STATIC_PEERS: it gets in only where we opened the network."""

import json
import os
import subprocess
import sys

import pytest

from ja_common.ros_defaults import PROFILE_VARIABLE
from ja_diagnostics.faults import hosts
from ros_testing import PATIENCE_S

NEAR = """
import sys
from ja_common.private_context import private_executor
from ja_common.ros_defaults import apply_ros_defaults
from ja_diagnostics.faults import hosts
from rclpy.node import Node
from std_srvs.srv import SetBool

hosts.prepare_host()
apply_ros_defaults()
with hosts.far_host() as host, private_executor() as executor:
    node = Node('gate', context=executor.context)
    calls = []
    def enable(request, response):
        calls.append(request.data)
        response.success = True
        return response
    node.create_service(SetBool, 'gate/enable', enable)
    executor.add_node(node)
    intruder = hosts.start_intruder(host, float(sys.argv[1]))
    while intruder.poll() is None:
        executor.spin_once(timeout_sec=0.05)
    print(intruder.stdout.read().strip())
    print('calls:', len(calls))
"""


def run_near(for_s: float, **environ: str) -> tuple[dict[str, list[str]], int]:
    """Return what the intruder found on a host with this environment, and how often it called."""
    names = ('ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS', PROFILE_VARIABLE)
    inherited = {name: value for name, value in os.environ.items() if name not in names}
    command = ['unshare', '--net', '--mount', sys.executable, '-c', NEAR, str(for_s)]
    ran = subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=PATIENCE_S,
        env={**inherited, **environ},
    )  # fmt: skip
    found, calls = ran.stdout.splitlines()
    return json.loads(found), int(calls.removeprefix('calls:'))


@pytest.mark.usefixtures('domain')
@pytest.mark.skipif(hosts.missing() != '', reason=hosts.missing())
@pytest.mark.parametrize(
    'environ',
    [
        {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'},
        {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'ROS_LOCALHOST_ONLY': '1'},
    ],
)
def test_in_the_range_of_this_machine_no_other_host_gets_in(environ):
    assert run_near(3.0, **environ) == ({'nodes': [], 'obeyed': []}, 0)


@pytest.mark.usefixtures('domain')
@pytest.mark.skipif(hosts.missing() != '', reason=hosts.missing())
def test_a_graph_on_the_network_is_found_and_obeys():
    found, calls = run_near(30.0, ROS_AUTOMATIC_DISCOVERY_RANGE='SUBNET')
    assert found == {'nodes': ['gate'], 'obeyed': ['/gate/enable']}
    assert calls == 1


@pytest.mark.usefixtures('domain')
@pytest.mark.skipif(hosts.missing() != '', reason=hosts.missing())
def test_a_host_that_we_name_in_the_range_of_this_machine_does_not_get_in_either():
    peers = {'ROS_STATIC_PEERS': '10.77.0.2'}
    found, calls = run_near(3.0, ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST', **peers)
    assert (found['obeyed'], calls) == ([], 0)
