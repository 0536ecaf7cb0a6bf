"""The table of topics: names that remap, and qualities of service that meet."""

import pytest
from rclpy.qos import HistoryPolicy, QoSCompatibility, ReliabilityPolicy, qos_check_compatible
from rclpy.qos import qos_profile_sensor_data as best_effort_camera
from rclpy.qos import qos_profile_system_default as reliable_camera

from ja_common.topics import CLOCK, DIAGNOSTICS, IMAGE, JOINT_STATES, LOG, TOPICS

by_name = pytest.mark.parametrize('topic', TOPICS, ids=lambda topic: topic.name)


def test_every_name_stands_once():
    names = [topic.name for topic in TOPICS]
    assert len(set(names)) == len(names) >= 15


@by_name
def test_names_are_relative_so_that_namespaces_work(topic):
    assert not topic.name.startswith('/') or topic in (CLOCK, DIAGNOSTICS, LOG)
    assert topic.purpose


@by_name
def test_subscriber_matches_publisher(topic):
    compatibility, reason = qos_check_compatible(topic.publisher_qos, topic.subscriber_qos)
    assert compatibility is not QoSCompatibility.ERROR, reason
    assert topic.subscriber_qos.history is HistoryPolicy.KEEP_LAST


@pytest.mark.parametrize('topic', [IMAGE, JOINT_STATES], ids=lambda topic: topic.name)
@pytest.mark.parametrize('driver', [best_effort_camera, reliable_camera])
def test_any_driver_is_received(topic, driver):
    assert qos_check_compatible(driver, topic.subscriber_qos)[0] is not QoSCompatibility.ERROR


def test_only_the_newest_image_waits():
    assert IMAGE.subscriber_qos.depth == 1
    assert IMAGE.subscriber_qos.reliability is ReliabilityPolicy.BEST_EFFORT
