"""The digital head as a node: a wide picture in, view, calibration and posture out."""

import numpy as np
import pytest
import rclpy
from sensor_msgs.msg import JointState

from ja_common.executor import CachedWaitSetExecutor
from ja_common.image_codec import decode_image, encode_image
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import CAMERA_INFO, IMAGE, JOINT_COMMANDS, JOINT_STATES, WIDE_IMAGE
from ja_sim.core.digital_head import DigitalHead
from ja_sim.digital_head_node import DigitalHeadNode
from ros_testing import spin_until

SECOND = 1_000_000_000


def test_obeys_commands_and_speaks_with_the_stamp_of_the_wide_picture(ros_context):
    head = DigitalHeadNode(context=ros_context)
    rig = rclpy.create_node('rig', context=ros_context)
    heard = {topic.name: [] for topic in (IMAGE, CAMERA_INFO, JOINT_STATES)}
    for topic in (IMAGE, CAMERA_INFO, JOINT_STATES):
        rig.create_subscription(
            topic.type, topic.name, heard[topic.name].append, topic.publisher_qos
        )
    wide = rig.create_publisher(WIDE_IMAGE.type, WIDE_IMAGE.name, WIDE_IMAGE.publisher_qos)
    commands = rig.create_publisher(JointState, JOINT_COMMANDS.name, JOINT_COMMANDS.publisher_qos)
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(head)
    executor.add_node(rig)
    spin_until(
        executor,
        lambda: (
            wide.get_subscription_count()
            and commands.get_subscription_count()
            and all(rig.count_publishers(name) for name in heard)
        ),
    )

    def show(seconds):
        before = len(heard[IMAGE.name])
        picture = np.zeros((480, 640, 3), np.uint8)
        wide.publish(encode_image(picture, to_time(seconds * SECOND), 'wide'))
        spin_until(executor, lambda: all(len(got) > before for got in heard.values()))
        return [heard[topic.name][-1] for topic in (IMAGE, CAMERA_INFO, JOINT_STATES)]

    image, info, joints = show(1)
    assert {to_ns(m.header.stamp) for m in (image, info, joints)} == {SECOND}
    assert (image.width, image.height, info.width, info.height) == (320, 240, 320, 240)
    assert info.k[0] == pytest.approx(160 / np.tan(np.radians(18)))
    assert list(joints.position) == [0.0, 0.0]
    commands.publish(JointState(name=['tilt', 'pan'], position=[-0.1, 0.2]))
    spin_until(executor, lambda: head._head._target[0])
    _, _, joints = show(3)
    assert list(joints.name) == ['pan', 'tilt']
    assert list(joints.position) == pytest.approx([0.2, -0.1], abs=1e-6)
    executor.shutdown()
    head.destroy_node()
    rig.destroy_node()


@pytest.mark.parametrize('degrees', [0, 90, 180, 270])
def test_the_window_is_mounted_as_the_wide_camera_is(make_bench, degrees):
    wide = np.random.default_rng(0).integers(0, 256, (480, 640, 3), np.uint8)
    delivered = np.ascontiguousarray(np.rot90(wide, degrees // 90))
    topics = [IMAGE, CAMERA_INFO]
    bench = make_bench(DigitalHeadNode, [WIDE_IMAGE], topics, image_rotation_deg=degrees)
    bench.publish(WIDE_IMAGE, encode_image(delivered, to_time(SECOND), 'wide'))
    bench.wait(lambda: all(bench.messages(topic) for topic in topics))
    image, info = (bench.messages(topic)[0] for topic in topics)
    upright, _ = DigitalHead().render_view(wide, SECOND)
    assert np.array_equal(np.rot90(decode_image(image), -degrees // 90), upright)
    assert (info.width, info.height) == (image.width, image.height)
