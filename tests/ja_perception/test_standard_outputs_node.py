"""`standard_outputs`: over real topics in, with stand-ins of the missing types out.

`test_standard_outputs_types.py` runs it with the real types.
"""

import subprocess
import sys
from collections import defaultdict

import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_common.image_codec import encode_image
from ja_common.optional_types import find_type, how_to_install
from ja_common.point_cloud_codec import encode_columns
from ja_common.time_codec import to_ns
from ja_common.topics import DETECTIONS, IMAGE
from ja_perception import standard_outputs_node
from ja_perception.standard_outputs_node import StandardOutputsNode
from node_bench import header
from seen_faces import BALL, FACE, IN, PERIOD_NS, READ, publish
from standard_stand_ins import HRI, VISION, StandIn

MISSING = pytest.mark.skipif(
    None not in (find_type('vision_msgs/msg/Detection2D'), find_type('hri_msgs/msg/IdsList')),
    reason='vision_msgs and hri_msgs are installed',
)


class Recorder:
    """Takes the place of a publisher of a type that ROS does not know here."""

    def __init__(self, topic):
        self.topic_name, self.messages = topic.name, []

    def publish(self, message):
        self.messages.append(message)

    def get_subscription_count(self):
        return 1


class RecordedNode(StandardOutputsNode):
    """The node, whose outputs are kept by the name of the topic."""

    def create_topic_publisher(self, topic):
        self.outputs = getattr(self, 'outputs', defaultdict(list))
        if not topic.name.startswith('/humans/') and not issubclass(topic.type, StandIn):
            return super().create_topic_publisher(topic)
        recorder = Recorder(topic)
        self.outputs[topic.name].append(recorder)
        return recorder

    def destroy_publisher(self, publisher):
        if not isinstance(publisher, Recorder):
            return super().destroy_publisher(publisher)
        self.outputs[publisher.topic_name].remove(publisher)
        return True

    def messages(self, name):
        """Return all messages of a topic that has not ended."""
        return [message for each in self.outputs[name] for message in each.messages]


@pytest.fixture
def install(monkeypatch):
    def install(vision=VISION, hri=HRI):
        monkeypatch.setattr(standard_outputs_node.VisionTypes, 'find', lambda: vision)
        monkeypatch.setattr(standard_outputs_node.HriTypes, 'find', lambda: hri)

    return install


@pytest.fixture
def make_outputs(make_bench, install):
    def make(vision=VISION, hri=HRI, **parameters):
        install(vision, hri)
        return make_bench(RecordedNode, IN, **parameters)

    return make


def stamps_of(messages):
    return [to_ns(message.header.stamp) // PERIOD_NS for message in messages]


def test_an_image_becomes_detections_and_faces(make_outputs):
    bench = make_outputs()
    publish(bench, 1, [BALL, READ], reading=True)
    landmarks = '/humans/faces/f3/landmarks'
    bench.wait(lambda: bench.node.messages(landmarks))
    [array] = bench.node.messages('detections_2d')
    assert [each.id for each in array.detections] == ['12', 'f3']
    [tracked] = bench.node.messages('/humans/faces/tracked')
    assert tracked.ids == ['f3']
    [roi] = bench.node.messages('/humans/faces/f3/roi')
    assert np.allclose((roi.xmin, roi.ymin, roi.xmax, roi.ymax), (
        30.5 / 80, 18.5 / 60, 50.5 / 80, 42.5 / 60,
    ))  # fmt: skip
    [cropped] = bench.node.messages('/humans/faces/f3/cropped')
    assert (cropped.width, cropped.height, cropped.encoding) == (128, 128, 'rgb8')
    [points] = bench.node.messages(landmarks)
    assert (points.width, points.height, len(points.landmarks)) == (80, 60, 70)
    for message in (array, tracked, roi, cropped, points):
        assert stamps_of([message]) == [1]
        assert message.header.frame_id == 'camera_optical_frame'


def test_images_without_faces_are_reported_as_empty(make_outputs):
    bench = make_outputs()
    publish(bench, 1, [])
    bench.wait(lambda: bench.node.messages('/humans/faces/tracked'))
    assert bench.node.messages('/humans/faces/tracked')[0].ids == []
    assert bench.node.messages('detections_2d')[0].detections == []


def test_the_topics_of_a_face_end_after_it(make_outputs):
    bench = make_outputs(topics_kept_s=0.0)
    publish(bench, 1, [FACE, FACE._replace(track_id=4)])
    bench.wait(lambda: bench.node.messages('/humans/faces/f4/roi'))
    publish(bench, 2, [FACE])
    bench.wait(lambda: not bench.node.outputs['/humans/faces/f4/roi'])
    assert not bench.node.outputs['/humans/faces/f4/cropped']
    assert stamps_of(bench.node.messages('/humans/faces/f3/roi')) == [1, 2]
    assert [each.ids for each in bench.node.messages('/humans/faces/tracked')] == [
        ['f3', 'f4'],
        ['f3'],
    ]


def test_a_lost_picture_costs_the_crop_alone_and_is_reported(make_outputs):
    bench = make_outputs()
    publish(bench, 1, [FACE])
    bench.wait(lambda: bench.node.messages('detections_2d'))
    publish(bench, 2, [FACE], image=False)
    publish(bench, 3, [FACE])
    bench.wait(lambda: len(bench.node.messages('detections_2d')) == 3)
    assert stamps_of(bench.node.messages('/humans/faces/f3/roi')) == [1, 2, 3]
    assert stamps_of(bench.node.messages('/humans/faces/f3/cropped')) == [1, 3]
    bench.wait_for_complaint('the picture of a detection did not come')


def test_detections_come_also_while_no_picture_does(make_outputs):
    bench = make_outputs()
    for index in range(1, 11):
        publish(bench, index, [FACE], image=False)
    bench.wait(lambda: len(bench.node.messages('detections_2d')) >= 2)
    assert stamps_of(bench.node.messages('detections_2d'))[:2] == [1, 2]
    assert not bench.node.messages('/humans/faces/f3/roi')


def test_a_lost_gaze_does_not_hold_up_the_next_image(make_outputs):
    bench = make_outputs()
    publish(bench, 1, [READ])
    publish(bench, 2, [READ], reading=True, landmarks=False)
    bench.wait(lambda: len(bench.node.messages('detections_2d')) == 2)
    assert stamps_of(bench.node.messages('detections_2d')) == [1, 2]


def test_pictures_without_detections_do_not_pile_up(make_outputs):
    bench = make_outputs()
    for index in range(1, 30):
        head = header(index * PERIOD_NS)
        bench.publish(IMAGE, encode_image(np.zeros((6, 8, 3), np.uint8), head.stamp, 'c'))
        bench.executor.spin_once(timeout_sec=0.05)
    assert len(bench.node._waiting) <= 8


def test_bad_detections_are_reported_and_the_next_ones_used(make_outputs):
    bench = make_outputs()
    bench.publish(DETECTIONS, encode_columns(header(PERIOD_NS), {'x': [1.0]}))
    head = header(PERIOD_NS)
    bench.publish(IMAGE, encode_image(np.zeros((6, 8, 3), np.uint8), head.stamp, 'c'))
    bench.wait_for_complaint('lacks the fields')
    publish(bench, 2, [FACE])
    bench.wait(lambda: bench.node.messages('/humans/faces/f3/roi'))


def test_one_package_alone_serves(make_outputs):
    bench = make_outputs(hri=None)
    publish(bench, 1, [FACE])
    bench.wait(lambda: bench.node.messages('detections_2d'))
    assert not any(name.startswith('/humans') for name in bench.node.outputs)
    assert how_to_install('hri_msgs') in bench.node.health.values['hri_msgs']
    other = make_outputs(vision=None)
    publish(other, 1, [FACE])
    other.wait(lambda: other.node.messages('/humans/faces/f3/roi'))
    assert 'detections_2d' not in other.node.outputs
    assert how_to_install('vision_msgs') in other.node.health.values['vision_msgs']


@pytest.mark.skipif(find_type('tf2_msgs/msg/TFMessage') is not None, reason='it is installed')
def test_one_line_of_the_log_states_what_is_missing(make_outputs, capfd):
    make_outputs(vision=None)
    [line] = [line for line in capfd.readouterr().err.splitlines() if 'published:' in line]
    assert 'published: /humans/faces;' in line
    assert f'vision_msgs is not installed ({how_to_install("vision_msgs")})' in line
    assert f'tf2_msgs is not installed ({how_to_install("tf2_msgs")})' in line


def test_without_both_packages_it_does_not_start(make_bench, install):
    install(None, None)
    with pytest.raises(ConfigError, match='neither vision_msgs nor hri_msgs'):
        make_bench(RecordedNode)


@MISSING
def test_its_process_ends_with_code_2_and_one_sentence(domain):
    command = [sys.executable, '-m', 'ja_perception.standard_outputs_node']
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    assert process.returncode == 2
    [line] = process.stderr.splitlines()
    assert how_to_install('vision_msgs', 'hri_msgs') in line
