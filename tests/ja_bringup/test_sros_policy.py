"""The SROS2 policy allows exactly what the running graph does."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from ja_bringup.reference import every_node
from ja_bringup.sros_policy import policy_xml

pytestmark = pytest.mark.usefixtures('domain')
BY_CONFIGURATION = {
    'robot_description',
    'joint_trajectory_controller/joint_trajectory',
    'forward_position_controller/commands',
}


def allowed(policy, node, group, verb):
    [profile] = policy.findall(f"enclaves/enclave[@path='/{node}']/profiles/profile")
    return {element.text for element in profile.findall(f"{group}[@{verb}='ALLOW']/*")}


def names(found):
    return {name.lstrip('/') for name, _ in found}


def test_the_policy_is_what_the_graph_reports_of_every_node():
    with every_node() as nodes:
        policy = ElementTree.fromstring(policy_xml(nodes))
        for node in nodes:
            name, where = node.get_name(), (node.get_name(), node.get_namespace())
            published = names(node.get_publisher_names_and_types_by_node(*where))
            subscribed = names(node.get_subscriber_names_and_types_by_node(*where))
            replied = names(node.get_service_names_and_types_by_node(*where))
            assert published <= allowed(policy, name, 'topics', 'publish')
            assert subscribed <= allowed(policy, name, 'topics', 'subscribe')
            assert replied <= allowed(policy, name, 'services', 'reply')
            spare = allowed(policy, name, 'topics', 'publish') - published
            assert spare <= BY_CONFIGURATION | {'parameter_events'}
            # A node subscribes to /clock where use_sim_time is on.
            spare = allowed(policy, name, 'topics', 'subscribe') - subscribed
            assert spare <= BY_CONFIGURATION | {'clock', 'parameter_events'}
        commanders = [
            n.get_name()
            for n in nodes
            if 'joint_commands' in allowed(policy, n.get_name(), 'topics', 'publish')
        ]
        assert commanders == ['gate'], 'it alone commands the head'
        without_truth = (
            'gate',
            'learning_module',
            'internal_evaluator',
            'salient_feature_detector',
        )
        for name in without_truth:
            assert not [t for t in allowed(policy, name, 'topics', 'subscribe') if 'sim/' in t]


def test_the_policy_in_docs_is_that_of_the_code():
    with every_node() as nodes:
        shipped = Path(__file__).parents[2] / 'docs' / 'sros2_policy.xml'
        assert shipped.read_text(encoding='utf-8') == policy_xml(nodes)
