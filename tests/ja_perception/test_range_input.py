"""The detector with depth images or a second camera: ranges, waiting, and bad messages."""

import math

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import Image

from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.detection import Kind
from ja_common.depth_encoder import DEPTH_ENCODINGS, encode_depth
from ja_common.detection_codec import decode_detections
from ja_common.image_codec import encode_image
from ja_common.time_codec import to_ns
from ja_common.topics import (
    CAMERA_INFO,
    DEPTH,
    DETECTIONS,
    IMAGE,
    JOINT_STATES,
    RIGHT_CAMERA_INFO,
    RIGHT_IMAGE,
)
from ja_perception.salient_feature_detector_node import SalientFeatureDetectorNode
from node_bench import NodeBench, header
from synthetic_pictures import draw_ball, draw_face, room

FOCAL_PX = 492.4
PERIOD_NS = 100_000_000
WALL_M, FACE_M, BALL_M = 2.7, 1.2, 0.8
BASELINE_M = 0.06
BALL = (280, 60)
INPUTS = {
    'none': (),
    'picture': (DEPTH,),
    'second_camera': (RIGHT_IMAGE, RIGHT_CAMERA_INFO),
}


def picture(ball=BALL, face=(160, 120)):
    canvas = room()
    draw_face(canvas, *face, 80)
    draw_ball(canvas, *ball, 14)
    return canvas


def depth():
    samples = np.full((240, 320), WALL_M, np.float32)
    cv2.ellipse(samples, (160, 120), (38, 50), 0, 0, 360, FACE_M, -1)
    cv2.circle(samples, BALL, 14, BALL_M, -1)
    samples[::3, ::3] = np.nan
    return samples


@pytest.fixture
def start(ros_context):
    """Return a function that starts a bench around the detector with parameters."""
    benches = []

    def make(sense='picture', **parameters):
        # The waiting of these tests ends when something has come, not after a time.
        options = {'depth': sense, 'depth_wait_s': 60.0, 'silent_after_s': 0.1} | parameters
        topics = [IMAGE, CAMERA_INFO, JOINT_STATES, *INPUTS[sense]]
        bench = NodeBench(ros_context, SalientFeatureDetectorNode, topics, [DETECTIONS], **options)
        benches.append(bench)
        return bench

    yield make
    for bench in benches:
        bench.close()


def send_image(bench, stamp_ns, turns=0):
    bench.publish_posture(stamp_ns)
    shown = np.ascontiguousarray(np.rot90(picture(), turns))
    height, width = shown.shape[:2]
    bench.publish(CAMERA_INFO, encode_camera_info(header(stamp_ns), width, height, FOCAL_PX))
    bench.publish(IMAGE, encode_image(shown, header(stamp_ns).stamp, 'eye'))


def send_depth(bench, stamp_ns, encoding='32FC1', turns=0):
    shown = np.rot90(depth(), turns)
    bench.publish(DEPTH, encode_depth(shown, encoding, header(stamp_ns).stamp, 'eye'))


def send_right(bench, stamp_ns, baseline_m=BASELINE_M, **changes):
    shifts = [round(FOCAL_PX * BASELINE_M / each) for each in (BALL_M, FACE_M)]
    shown = picture((BALL[0] - shifts[0], BALL[1]), (160 - shifts[1], 120))
    info = encode_camera_info(header(stamp_ns), 320, 240, FOCAL_PX, baseline_m=baseline_m)
    for name, value in changes.items():
        setattr(info, name, value)
    bench.publish(RIGHT_CAMERA_INFO, info)
    bench.publish(RIGHT_IMAGE, encode_image(shown, header(stamp_ns).stamp, 'eye'))


def answer(bench, count=1):
    bench.wait(lambda: len(bench.messages(DETECTIONS)) >= count)
    message = bench.messages(DETECTIONS)[count - 1]
    return decode_detections(message), to_ns(message.header.stamp)


def assert_ranges(detections, rel=0.02):
    face, ball = detections
    assert (face.kind, ball.kind) == (Kind.FACE, Kind.OBJECT)
    for detection, z in ((face, FACE_M), (ball, BALL_M)):
        along = z * math.hypot(1, *detection.ray)
        assert detection.range_m == pytest.approx(along, rel=rel)
        assert 0 < detection.range_deviation_m < 0.05 * along


def assert_no_ranges(detections):
    assert len(detections) == 2
    assert all(np.isnan(each.range).all() for each in detections)


def test_without_the_parameter_nothing_is_subscribed_to_and_no_range_is_known(start):
    bench = start('none')
    names = {topic.name for topic in bench.node.subscribed_topics.values()}
    assert not names & {DEPTH.name, RIGHT_IMAGE.name, RIGHT_CAMERA_INFO.name}
    send_image(bench, PERIOD_NS)
    assert_no_ranges(answer(bench)[0])
    assert 'range' not in bench.complaint()


@pytest.mark.parametrize('encoding', DEPTH_ENCODINGS)
def test_depth_images_give_the_range_along_the_ray(start, encoding):
    bench = start()
    send_depth(bench, PERIOD_NS, encoding)
    send_image(bench, PERIOD_NS)
    assert_ranges(answer(bench)[0])
    assert bench.node.health.values['detections with a range'] == '2 of 2'


def test_an_image_waits_for_the_depth_of_its_own_stamp(start):
    """The one before is near enough, and is not taken: so every run is the same."""
    bench = start(depth_within_s=0.15)
    near = np.full((240, 320), 0.5, np.float32)
    bench.publish(DEPTH, encode_depth(near, '32FC1', header(PERIOD_NS).stamp, 'eye'))
    send_image(bench, 2 * PERIOD_NS)
    bench.wait(lambda: bench.received(IMAGE) and bench.received(JOINT_STATES))
    assert not bench.messages(DETECTIONS)
    send_depth(bench, 2 * PERIOD_NS)
    detections, stamp_ns = answer(bench)
    assert stamp_ns == 2 * PERIOD_NS
    assert_ranges(detections)


def test_an_image_without_depth_goes_on_and_the_cause_is_reported(start):
    bench = start(depth_wait_s=0.0)
    for count in (1, 2, 3):
        send_image(bench, count * PERIOD_NS)
        assert_no_ranges(answer(bench, count)[0])
    bench.wait_for_complaint('no message on /depth/image_raw')
    send_depth(bench, 4 * PERIOD_NS)
    send_image(bench, 4 * PERIOD_NS)
    assert_ranges(answer(bench, 4)[0])


def test_stamps_too_far_apart_are_named(start):
    bench = start(silent_after_s=0.1)
    number = 1

    def apart():
        nonlocal number
        number += 1
        send_depth(bench, number * PERIOD_NS + 50_000_000)
        send_image(bench, number * PERIOD_NS)
        assert_no_ranges(answer(bench, number - 1)[0])
        return 'is stamped 50 ms off the image, more than 20 ms' in bench.complaint()

    bench.wait(apart)


def test_a_camera_that_hangs_turned_has_its_depth_turned_as_well(start):
    bench = start(image_rotation_deg=90)
    send_depth(bench, PERIOD_NS, turns=1)
    send_image(bench, PERIOD_NS, turns=1)
    assert_ranges(answer(bench)[0])


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        (dict(encoding='rgb8'), "'rgb8' is no depth"),
        (dict(step=10), 'step is 10'),
        (dict(data=b'short'), '5 bytes of data'),
        (dict(width=0), 'no pixels'),
        (dict(height=90), '320x90, but the image 320x240'),
    ],
)
def test_a_bad_depth_image_is_named_and_the_next_good_one_is_used(start, changes, reason):
    bench = start()
    fields = dict(width=320, height=240, encoding='32FC1', step=1280, data=bytes(320 * 240 * 4))
    bench.publish(DEPTH, Image(header=header(PERIOD_NS), **(fields | changes)))
    send_image(bench, PERIOD_NS)
    assert_no_ranges(answer(bench)[0])
    assert reason in bench.complaint()
    send_depth(bench, 2 * PERIOD_NS)
    send_image(bench, 2 * PERIOD_NS)
    assert_ranges(answer(bench, 2)[0])
    assert reason not in bench.complaint()


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf, 0.0, -3.0])
def test_a_depth_image_without_any_depth_gives_none(start, value):
    bench = start()
    nothing = np.full((240, 320), value, np.float32)
    bench.publish(DEPTH, encode_depth(nothing, '32FC1', header(PERIOD_NS).stamp, 'eye'))
    send_image(bench, PERIOD_NS)
    assert_no_ranges(answer(bench)[0])


def test_a_second_camera_gives_the_ranges(start):
    bench = start('second_camera')
    send_right(bench, PERIOD_NS)
    send_image(bench, PERIOD_NS)
    assert_ranges(answer(bench)[0], rel=0.03)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        (dict(baseline_m=0.0), 'no baseline to the right'),
        (dict(baseline_m=-0.06), 'swap left and right'),
        (dict(d=[0.1, 0.0, 0.0, 0.0, 0.0]), 'without lens distortion'),
        (dict(p=[0.0] * 12), 'not calibrated'),
    ],
)
def test_a_second_camera_that_cannot_be_used_is_named(start, changes, reason):
    bench = start('second_camera')
    send_right(bench, PERIOD_NS, **changes)
    send_image(bench, PERIOD_NS)
    assert_no_ranges(answer(bench)[0])
    bench.wait_for_complaint(reason)
    send_right(bench, 2 * PERIOD_NS)
    send_image(bench, 2 * PERIOD_NS)
    assert_ranges(answer(bench, 2)[0], rel=0.03)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        (dict(r=[0.98, -0.2, 0.0, 0.2, 0.98, 0.0, 0.0, 0.0, 1.0]), 'R turns the images'),
        (dict(p=[math.nan] * 12), 'P finite'),
    ],
)
def test_a_calibration_that_is_refused_is_named(start, changes, reason):
    bench = start('second_camera')
    send_right(bench, PERIOD_NS, **changes)
    send_image(bench, PERIOD_NS)
    assert_no_ranges(answer(bench)[0])
    bench.wait_for_complaint(reason)
    bench.wait_for_complaint('no usable right/camera_info')


def test_depth_of_another_frame_is_not_registered_and_gives_no_range(start):
    bench = start()
    send_image(bench, PERIOD_NS)
    bench.publish(DEPTH, encode_depth(depth(), '32FC1', header(PERIOD_NS).stamp, 'depth_eye'))
    found, _ = answer(bench)
    assert_no_ranges(found)
    bench.wait_for_complaint("of the frame 'depth_eye', the image of 'eye'")


def test_depth_of_holes_alone_is_reported(start):
    bench = start()
    holes = np.zeros((240, 320), np.float32)
    sent = []

    def is_reported():
        sent.append(PERIOD_NS * (len(sent) + 1))
        send_image(bench, sent[-1])
        bench.publish(DEPTH, encode_depth(holes, '32FC1', header(sent[-1]).stamp, 'eye'))
        answer(bench, len(sent))
        return 'hold no distance where things are seen' in bench.complaint()

    bench.wait(is_reported)


def test_the_same_image_again_is_no_frozen_camera(start):
    bench = start('none', frozen_after_s=0.05)
    send_image(bench, PERIOD_NS)
    answer(bench)
    for count in range(2, 12):
        send_image(bench, PERIOD_NS)  # a paused simulation
        answer(bench, count)
    assert 'same' not in bench.complaint()
