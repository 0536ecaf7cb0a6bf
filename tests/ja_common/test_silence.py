"""Why nothing comes: the cause and what to do, and not only that nothing comes."""

from dataclasses import dataclass

import pytest
import rclpy
from sensor_msgs.msg import Image

from ja_common.core.config import Configuration, parameter
from ja_common.graph_node import GraphNode
from ja_common.private_context import private_context
from ja_common.topics import CLOCK, IMAGE, IMAGE_COMPRESSED
from node_bench import header


@dataclass(frozen=True)
class Eyes(Configuration):
    compressed: bool = parameter(False, 'whether')


class Watcher(GraphNode):
    """Expects pictures, which may be compressed."""

    def __init__(self, **node_kwargs):
        super().__init__('watcher', **node_kwargs)
        self.topic = IMAGE_COMPRESSED if self.configure(Eyes).compressed else IMAGE
        self.subscribe(self.topic, lambda message: None, expected_every_s=0.05)


@pytest.mark.parametrize(
    ('compressed', 'published', 'cause'),
    [
        (
            False,
            IMAGE_COMPRESSED,
            'only /image_raw/compressed: set the parameter compressed:=true',
        ),
        (True, IMAGE, 'only /image_raw: set the parameter compressed:=false'),
    ],
)
def test_silence_is_explained_by_the_other_form_of_the_pictures(
    make_bench, compressed, published, cause
):
    bench = make_bench(Watcher, compressed=compressed)
    bench.peer.create_publisher(published.type, published.name, published.publisher_qos)
    bench.wait_for_complaint(f'peer publishes {cause}')


def test_silence_is_explained_by_another_name_of_the_topic(make_bench):
    bench = make_bench(Watcher)
    bench.peer.create_publisher(Image, 'head_camera/color/image_raw', 5)
    bench.peer.create_publisher(Image, 'face_image', 5)  # of this project
    bench.wait_for_complaint(
        'of its type there is /head_camera/color/image_raw: '
        'remap with -r image_raw:=/head_camera/color/image_raw'
    )
    assert 'face_image' not in bench.complaint()


def test_silence_names_the_domain_and_how_far_nodes_are_sought(make_bench, domain):
    make_bench(Watcher).wait_for_complaint(
        f'no node publishes it, in ROS_DOMAIN_ID {domain} of this machine alone '
        '(ROS_AUTOMATIC_DISCOVERY_RANGE)'
    )


def test_silence_is_explained_by_another_type(make_bench, domain):
    bench = make_bench(Watcher)
    with private_context(domain_id=domain) as other_process:
        driver = rclpy.create_node('driver', context=other_process)
        driver.create_publisher(IMAGE_COMPRESSED.type, IMAGE.name, 1)
        bench.wait_for_complaint(
            'driver publishes sensor_msgs/msg/CompressedImage there, and sensor_msgs/msg/Image is '
            'needed'
        )
        driver.destroy_node()


def test_messages_without_a_time_are_reported(make_bench):
    bench = make_bench(Watcher, publishes=[IMAGE])
    bench.publish(IMAGE, Image())
    bench.wait(lambda: bench.received(IMAGE) == 1)
    assert 'no time' not in bench.complaint(), 'a simulation may begin at 0'
    bench.publish(IMAGE, Image())
    bench.wait_for_complaint('/image_raw: the messages carry no time (header.stamp is 0)')


@pytest.mark.parametrize(('off_s', 'where'), [(3600, 'ahead of'), (-3600, 'behind')])
def test_stamps_of_another_clock_are_reported(make_bench, off_s, where):
    bench = make_bench(Watcher, publishes=[IMAGE])
    now_ns = bench.node.get_clock().now().nanoseconds
    bench.publish(IMAGE, Image(header=header(now_ns)))
    bench.wait(lambda: bench.received(IMAGE) == 1)
    assert 'stamped' not in bench.complaint()
    bench.publish(IMAGE, Image(header=header(now_ns + off_s * 10**9)))
    bench.wait_for_complaint(f' s {where} the clock of this node: set use_sim_time')


def test_simulated_time_that_nothing_publishes_is_reported(make_bench):
    bench = make_bench(Watcher, use_sim_time=True)
    bench.wait_for_complaint('use_sim_time is true, and no node publishes /clock')
    bench.peer.create_publisher(CLOCK.type, CLOCK.name, CLOCK.publisher_qos)
    bench.wait(lambda: '/clock' not in bench.complaint())


def test_a_parameter_that_the_node_does_not_have_is_reported(make_bench):
    bench = make_bench(Watcher, compresed=True)
    bench.node.check_parameters([])
    bench.wait_for_complaint('/watcher has no parameter compresed: is compressed meant?')
