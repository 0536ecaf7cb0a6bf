"""Private contexts: they end with their block, and leave signals and environment alone."""

import os
import signal

import pytest
import rclpy
from rclpy.node import Node

from ja_common.private_context import private_context, private_executor
from ros_testing import spin_until

RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


def test_context_ends_with_its_block_and_is_not_the_default_one(domain):
    with private_context() as context:
        assert context.ok()
        assert context.get_domain_id() == domain
        assert not rclpy.ok()
    assert not context.ok()


def test_signals_stay_with_the_caller(domain):
    before = signal.getsignal(signal.SIGINT)
    with private_context():
        assert signal.getsignal(signal.SIGINT) is before
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)


def test_arguments_are_for_all_nodes_of_the_context(domain):
    with private_context(['-r', '__ns:=/robot', '-p', 'use_sim_time:=true']) as context:
        node = Node('node', context=context)
        assert node.get_namespace() == '/robot'
        assert node.get_parameter('use_sim_time').value is True
        node.destroy_node()


@pytest.mark.parametrize('before', ['LOCALHOST', None])
def test_without_discovery_no_other_context_is_found(domain, monkeypatch, before):
    if before is None:
        monkeypatch.delenv(RANGE)
    else:
        monkeypatch.setenv(RANGE, before)
    with private_context(discovery=False) as alone, private_executor() as executor:
        assert os.environ.get(RANGE) == before
        others = [Node(name, context=executor.context) for name in ('first', 'second')]
        for node in others:
            executor.add_node(node)
        hidden = Node('hidden', context=alone)
        spin_until(executor, lambda: 'second' in others[0].get_node_names())
        assert 'hidden' not in others[0].get_node_names()
        assert hidden.get_node_names() == ['hidden']
        hidden.destroy_node()


def test_executor_ends_its_nodes(domain):
    with private_executor() as executor:
        node = Node('node', context=executor.context)
        executor.add_node(node)
    assert executor.get_nodes() == []
    assert not executor.context.ok()
    with pytest.raises(rclpy.exceptions.InvalidHandle):
        node.get_node_names()
