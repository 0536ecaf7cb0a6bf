"""The camera node: a file becomes image_raw and camera_info."""

import math

import cv2
import numpy as np
import pytest
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from ja_common.executor import CachedWaitSetExecutor
from ja_common.image_codec import decode_image
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import CAMERA_INFO, CLOCK, DIAGNOSTICS, IMAGE
from ja_perception.camera_node import CameraNode
from picture_files import cut, flat, write_film, write_picture
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


def reported(bench, text):
    """Wait until the node reports a text in its diagnostics; return its status."""

    def find():
        return [
            status
            for message in bench.messages(DIAGNOSTICS)
            for status in message.status
            if status.name == '/camera'
            and text in ' '.join([status.message, *(pair.value for pair in status.values)])
        ]

    bench.wait(find)
    return find()[-1]


def test_what_a_folder_leaves_out_is_in_the_diagnostics_and_the_node_runs_on(make_bench, tmp_path):
    write_picture(tmp_path / '1.png', flat((200, 0, 0)))
    write_picture(tmp_path / '2.png', flat((0, 200, 0)))
    cut(tmp_path / '2.png')
    (tmp_path / '._1.png').write_bytes(b'a file of macOS')
    parameters = {'source': str(tmp_path), 'rate_hz': 50.0, 'still_s': 0.1}
    bench = make_bench(CameraNode, [], [IMAGE, DIAGNOSTICS], **parameters)
    bench.next(IMAGE, 20)
    status = reported(bench, '2.png')
    assert 'ends early' in status.message
    values = {pair.key: pair.value for pair in status.values}
    assert values['source'].startswith('1 of 3 files')
    assert '._1.png' in values['source']
    bench.next(IMAGE, 5)


def test_a_film_is_published_at_its_own_times_and_1000_a_second_is_bounded(make_bench, tmp_path):
    film = write_film(tmp_path / 'fast.mp4', [flat((200, 0, 0))] * 40, 1000.0, 'mp4v')
    parameters = {'source': film, 'highest_rate_hz': 20.0}
    bench = make_bench(CameraNode, [], [IMAGE, DIAGNOSTICS], **parameters)
    first = to_ns(bench.next(IMAGE).header.stamp)
    count = 20
    last = to_ns(bench.next(IMAGE, count).header.stamp)
    # Never faster than bounded; slower where this computer is busy.
    assert (last - first) / 1e9 > 0.9 * count / 20.0
    assert 'claims 1000 pictures/s' in reported(bench, 'claims').message


def test_a_film_without_a_loop_ends_the_node(ros_context, tmp_path):
    film = write_film(tmp_path / 'clip.avi', [flat((200, 0, 0))] * 3, 50.0)
    node = camera(ros_context, source=film, loop=False)
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(node)
    with pytest.raises(ExternalShutdownException):
        spin_until(executor, lambda: False, 60.0)
    executor.shutdown()
    node.destroy_node()
