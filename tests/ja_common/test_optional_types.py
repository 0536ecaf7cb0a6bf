"""Message types that may be missing."""

from sensor_msgs.msg import Image

from ja_common.optional_types import find_type, how_to_install


def test_a_type_is_found_or_none():
    assert find_type('sensor_msgs/msg/Image') is Image
    assert find_type('sensor_msgs/msg/Picture') is None
    assert find_type('no_such_msgs/msg/Image') is None


def test_the_packages_of_the_distribution_are_named(monkeypatch):
    monkeypatch.setenv('ROS_DISTRO', 'kilted')
    expected = 'apt install ros-kilted-vision-msgs ros-kilted-hri-msgs'
    assert how_to_install('vision_msgs', 'hri_msgs') == expected
    monkeypatch.delenv('ROS_DISTRO')
    assert how_to_install('tf2_msgs') == 'apt install ros-jazzy-tf2-msgs'
