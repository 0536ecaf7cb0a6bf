"""`markers`: listens and publishes only while it is read, with the stamp of the image."""

import math
import random

import numpy as np
import pytest
from std_msgs.msg import Header

from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.detection import Detection, Kind
from ja_common.core.face_gaze import FaceGaze
from ja_common.detection_codec import encode_detections
from ja_common.face_gaze_codec import encode_face_gaze
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.point_cloud_codec import encode_columns
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    BELIEF,
    CAMERA_INFO,
    DETECTIONS,
    FACE_GAZE,
    FIXATION,
    JOINT_COMMANDS,
    JOINT_STATES,
    MARKERS,
)
from ja_dashboard.markers_node import MarkersNode
from node_bench import header
from odd_messages import extreme, foreign, malformed

READ = [CAMERA_INFO, JOINT_STATES, JOINT_COMMANDS, FIXATION, BELIEF, FACE_GAZE, DETECTIONS]
OBJECT = Detection(Kind.OBJECT, 0.1, 0.0, 192.0, 120.0, 40.0, 50.0, 0.9, track_id=4)
FACE = Detection(Kind.FACE, 0.0, 0.0, 160.0, 120.0, 40.0, 50.0, 0.9, gaze_read=True)
GAZE = FaceGaze(np.zeros(3), 0.03, np.full((2, 2), math.nan), 0.04)


class Course:
    """Images, as the nodes of the graph publish them."""

    def __init__(self, bench):
        self.bench = bench
        self.stamp_ns = 10**9
        self.subscription = None
        for topic in READ:
            publisher = bench.peer.create_publisher(topic.type, topic.name, topic.publisher_qos)
            bench._publishers[topic.name] = publisher

    def open_viewer(self):
        keep = self.bench.messages(MARKERS).append
        self.subscription = self.bench.peer.create_subscription(
            MARKERS.type, MARKERS.name, keep, MARKERS.subscriber_qos
        )
        self.bench.wait(lambda: set(self.bench.node.polled_subscriptions) == set(READ))
        polled = self.bench.node.polled_subscriptions
        self.bench.wait(lambda: all(polled[topic].publishers for topic in READ))

    def image(self, detections, joints=True):
        self.stamp_ns += 10**8
        head, codec = header(self.stamp_ns), JointCodec(JointConfig())
        messages = {
            CAMERA_INFO: encode_camera_info(head, 320, 240, 492.0),
            JOINT_COMMANDS: codec.encode_posture(head, [0.3, 0.0]),
            FIXATION: codec.encode(head, [0.2, -0.1]),
            BELIEF: encode_columns(head, {'pan': [0.1], 'tilt': [0.0], 'weight': [1.0]}),
            FACE_GAZE: encode_face_gaze(head, GAZE),
            DETECTIONS: encode_detections(head, detections),
        }
        if joints:
            messages[JOINT_STATES] = codec.encode_posture(head, [0.2, -0.1], [0.0, 0.0])
        for topic, message in messages.items():
            self.bench.publish(topic, message)

    def drawn(self, detections):
        """Publish images until one is drawn; return its message and its groups."""
        before = len(self.bench.messages(MARKERS))

        def shown():
            self.image(detections)
            return len(self.bench.messages(MARKERS)) > before + 1

        self.bench.wait(shown)
        message = self.bench.messages(MARKERS)[-1]
        return message, {each.ns for each in message.markers if each.ns}


@pytest.fixture
def make_course(make_bench):
    def make(**parameters):
        return Course(make_bench(MarkersNode, **parameters))

    return make


def test_all_groups_come_with_the_stamp_of_one_image(make_course):
    course = make_course(base_frame='head_base')
    course.open_viewer()
    first_ns = course.stamp_ns
    message, groups = course.drawn([OBJECT, FACE])
    assert groups == {
        'object_rays', 'object_labels', 'face_rays', 'face_labels', 'fixation_circle',
        'field_of_view', 'belief', 'gaze', 'commanded', 'attended',
    }  # fmt: skip
    [stamp_ns] = {to_ns(each.header.stamp) for each in message.markers}
    assert first_ns < stamp_ns <= course.stamp_ns
    assert (stamp_ns - first_ns) % 10**8 == 0
    assert {each.header.frame_id for each in message.markers} == {'head_base'}
    _, groups = course.drawn([])
    assert not groups & {'object_rays', 'object_labels', 'face_rays', 'face_labels', 'gaze'}


def test_without_a_viewer_it_neither_listens_nor_publishes(make_course):
    course = make_course()
    publishers = course.bench._publishers
    assert not course.bench.node.polled_subscriptions
    course.open_viewer()
    course.drawn([OBJECT])
    course.bench.peer.destroy_subscription(course.subscription)
    course.bench.wait(
        lambda: not any(publishers[topic.name].get_subscription_count() for topic in READ)
    )
    assert not course.bench.node.polled_subscriptions
    course.open_viewer()
    course.drawn([OBJECT])


def test_without_a_posture_nothing_is_drawn_and_one_sentence_tells_why(make_course):
    course = make_course()
    course.open_viewer()

    def complained():
        course.image([OBJECT], joints=False)
        return 'no posture at the stamp of an image' in course.bench.complaint()

    course.bench.wait(complained)
    assert not course.bench.messages(MARKERS)
    course.drawn([OBJECT])
    assert 'no posture' not in course.bench.complaint()


def test_it_outlives_odd_messages(make_course):
    course, rng = make_course(), random.Random(0)
    course.open_viewer()
    problems, record = [], course.bench.node.health.record_problem

    def keep(where, message, *args, **kwargs):
        problems.append(message)
        return record(where, message, *args, **kwargs)

    course.bench.node.health.record_problem = keep
    for number in range(40):
        head = Header(stamp=to_time(10**6 * number), frame_id='eye')
        for topic in READ:
            odd = [malformed(topic.type, rng), extreme(topic.type, head, rng)]
            for message in [*odd, rng.choice(foreign(topic.type, head))]:
                course.bench.publish(topic, message)
        course.bench.executor.spin_once(timeout_sec=0.02)
    _, groups = course.drawn([OBJECT])
    assert 'object_rays' in groups
    assert problems
    assert not [text for text in problems if 'Traceback' in text]
