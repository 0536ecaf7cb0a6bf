"""The camera node: a file becomes image_raw and camera_info."""

import math

import cv2
import numpy as np
import pytest
import rclpy
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from ja_common.executor import CachedWaitSetExecutor
from ja_common.image_codec import decode_image
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import CAMERA_INFO, CLOCK, IMAGE
from ja_perception.camera_node import CameraNode
from ros_testing import spin_until


def camera(context, **parameters):
    overrides = [Parameter(name, value=value) for name, value in parameters.items()]
    return CameraNode(context=context, parameter_overrides=overrides)


def test_pictures_and_calibration_come_together(ros_context, tmp_path):
    picture = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
    path = tmp_path / 'still.png'
    cv2.imwrite(str(path), picture[..., ::-1])
    node = camera(
        ros_context, source=str(path), rate_hz=50.0, field_of_view_rad=1.0, frame_id='eye'
    )
    listener = rclpy.create_node('listener', context=ros_context)
    images, infos = [], []
    listener.create_subscription(IMAGE.type, 'image_raw', images.append, IMAGE.subscriber_qos)
    listener.create_subscription(
        CAMERA_INFO.type, 'camera_info', infos.append, IMAGE.subscriber_qos
    )
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(node)
    executor.add_node(listener)
    spin_until(executor, lambda: len(images) >= 3 and len(infos) >= 3)
    executor.shutdown()
    assert np.array_equal(decode_image(images[0]), picture)
    assert images[0].header.frame_id == 'eye'
    assert images[0].header.stamp in [info.header.stamp for info in infos]
    assert infos[0].k[0] == pytest.approx(32 / math.tan(0.5))
    node.destroy_node()
    listener.destroy_node()


def test_pictures_come_while_the_clock_stands_still_and_after_it_was_set_back(
    make_bench, tmp_path
):
    path = tmp_path / 'still.png'
    cv2.imwrite(str(path), np.zeros((8, 8, 3), np.uint8))
    parameters = {'source': str(path), 'rate_hz': 100.0, 'use_sim_time': True}
    bench = make_bench(CameraNode, [CLOCK], [IMAGE], **parameters)
    for now_ns in (7200 * 10**9, 3600 * 10**9):
        bench.publish(CLOCK, Clock(clock=to_time(now_ns)))
        bench.wait(lambda now_ns=now_ns: to_ns(bench.next(IMAGE).header.stamp) == now_ns)
        assert to_ns(bench.next(IMAGE, 3).header.stamp) == now_ns


def test_source_that_cannot_be_opened_ends_the_node_with_one_sentence(ros_context):
    with pytest.raises(OSError, match="no such file, folder or device: 'nowhere'"):
        camera(ros_context, source='nowhere')
