"""The detector as a node: one detections message an image, with the image's own header."""

import cv2
import numpy as np
import pytest
import rclpy
from builtin_interfaces.msg import Time
from rclpy.parameter import Parameter
from sensor_msgs.msg import CompressedImage, Image, JointState
from std_msgs.msg import Header

from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.detection import Kind, caregiver_face
from ja_common.detection_codec import decode_detections
from ja_common.executor import CachedWaitSetExecutor
from ja_common.face_gaze_codec import decode_face_gaze
from ja_common.image_codec import decode_image, encode_image
from ja_common.point_cloud_codec import decode_columns
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    CAMERA_INFO,
    DETECTIONS,
    DIAGNOSTICS,
    FACE,
    FACE_GAZE,
    FACE_IMAGE,
    FACE_LANDMARKS,
    IMAGE,
    IMAGE_ANNOTATED,
    IMAGE_COMPRESSED,
    JOINT_STATES,
    TARGET,
)
from ja_perception.salient_feature_detector_node import SalientFeatureDetectorNode
from ros_testing import PATIENCE_S, spin_until
from synthetic_pictures import draw_ball, draw_face, room

FOCAL_PX = 492.4  # 320 px across 36 degrees
PERIOD_NS = 100_000_000


class Rig:
    """Publishes what a rig would, and stores all that the detector publishes."""

    def __init__(self, context, **parameters):
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        self.detector = SalientFeatureDetectorNode(context=context, parameter_overrides=overrides)
        self.node = rclpy.create_node('rig', context=context)
        self.executor = CachedWaitSetExecutor(context=context)
        self.executor.add_node(self.detector)
        self.executor.add_node(self.node)
        self.heard = []
        for topic in (DETECTIONS, FACE_IMAGE, TARGET, FACE, DIAGNOSTICS):
            self.listen(topic)
        self.publishers = {
            topic.name: self.node.create_publisher(topic.type, topic.name, topic.publisher_qos)
            for topic in (IMAGE, CAMERA_INFO, JOINT_STATES)
        }
        subscribed = [p for n, p in self.publishers.items() if n != IMAGE.name or not parameters]
        self.wait(lambda: all(p.get_subscription_count() for p in subscribed))

    def listen(self, topic):
        def keep(message):
            self.heard.append((topic.name, message))

        self.node.create_subscription(topic.type, topic.name, keep, topic.publisher_qos)
        self.wait(lambda: self.node.count_publishers(topic.name))

    def wait(self, condition, timeout_s=PATIENCE_S):
        spin_until(self.executor, condition, timeout_s)

    def all_of(self, topic):
        return [message for name, message in self.heard if name == topic.name]

    def joints(self, stamp_ns, pan=0.0, tilt=0.0, speed=0.0):
        self.publishers[JOINT_STATES.name].publish(
            JointState(
                header=Header(stamp=to_time(stamp_ns)),
                name=['pan', 'tilt'],
                position=[pan, tilt],
                velocity=[speed, 0.0],
            )
        )

    def image(self, stamp_ns, picture, focal_px=None):
        header = Header(stamp=to_time(stamp_ns), frame_id='eye')
        height, width = picture.shape[:2]
        info = encode_camera_info(header, width, height, focal_px or FOCAL_PX * width / 320)
        self.publishers[CAMERA_INFO.name].publish(info)
        self.publishers[IMAGE.name].publish(encode_image(picture, header.stamp, 'eye'))

    def answer(self, count=1):
        self.wait(lambda: len(self.all_of(DETECTIONS)) >= count)
        return self.all_of(DETECTIONS)[-1]

    def diagnosis(self, text):
        def found():
            return [
                s
                for m in self.all_of(DIAGNOSTICS)
                for s in m.status
                if 'salient' in s.name and text in s.message
            ]

        self.wait(found)
        return found()[0]

    def close(self):
        self.executor.shutdown()
        self.detector.destroy_node()
        self.node.destroy_node()


@pytest.fixture
def rig(ros_context):
    rig = Rig(ros_context)
    yield rig
    rig.close()


def caregiver_and_ball():
    picture = room()
    draw_face(picture, 160, 120, 80)
    draw_ball(picture, 280, 60, 14)
    return picture


def test_header_goes_on_unchanged_and_empty_images_are_answered_too(rig):
    for count in range(1, 4):
        stamp_ns = count * PERIOD_NS
        rig.joints(stamp_ns)
        rig.image(stamp_ns, room())
        message = rig.answer(count)
        assert to_ns(message.header.stamp) == stamp_ns
        assert message.header.frame_id == 'eye'
        assert decode_detections(message) == []
    assert not rig.all_of(FACE_IMAGE)


def test_image_sent_again_gets_the_same_answer_and_counts_once(rig):
    for stamp_ns in (PERIOD_NS, 2 * PERIOD_NS):
        rig.joints(stamp_ns)
    for count, stamp_ns in enumerate([1, 1, 1, 2], start=1):
        rig.image(stamp_ns * PERIOD_NS, caregiver_and_ball())
        rig.answer(count)
    first, second, third, fourth = rig.all_of(DETECTIONS)
    assert bytes(first.data) == bytes(second.data) == bytes(third.data)
    assert second.header == first.header
    assert to_ns(fourth.header.stamp) == 2 * PERIOD_NS


def test_attended_face_comes_with_its_picture(rig):
    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, caregiver_and_ball())
    detections = decode_detections(rig.answer())
    face, ball = detections
    assert face.kind is Kind.FACE
    assert face.attended
    assert (ball.u, ball.v) == pytest.approx((280, 60), abs=1)
    assert ball.ray == pytest.approx((120.5 / FOCAL_PX, -59.5 / FOCAL_PX), abs=0.003)
    rig.wait(lambda: rig.all_of(FACE_IMAGE))
    (picture,) = rig.all_of(FACE_IMAGE)
    assert (picture.height, picture.width, picture.encoding) == (30, 25, 'mono8')
    assert to_ns(picture.header.stamp) == PERIOD_NS
    rig.wait(lambda: rig.all_of(TARGET) and rig.all_of(FACE))
    assert rig.all_of(TARGET)[0].point.x == pytest.approx(ball.x)


def test_moving_head_does_not_attend(rig):
    rig.joints(PERIOD_NS, speed=0.5)
    rig.image(PERIOD_NS, caregiver_and_ball())
    face = caregiver_face(decode_detections(rig.answer()))
    assert face is not None
    assert not face.attended


def test_image_waits_for_the_posture_at_its_own_stamp(rig):
    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, room())
    rig.answer()
    rig.image(2 * PERIOD_NS, room())
    rig.wait(lambda: rig.detector._synchroniser.waits_for_posture or None)
    assert len(rig.all_of(DETECTIONS)) == 1
    rig.joints(2 * PERIOD_NS)
    assert to_ns(rig.answer(2).header.stamp) == 2 * PERIOD_NS


def test_fixed_camera_without_joint_states_still_detects_and_says_so(rig):
    rig.image(PERIOD_NS, caregiver_and_ball())
    detections = decode_detections(rig.answer())
    assert [d.kind for d in detections] == [Kind.FACE, Kind.OBJECT]
    assert not any(d.attended for d in detections)
    assert rig.diagnosis('no joint state').level == b'\x01'


def test_broken_image_gives_one_clear_error_and_the_node_lives_on(rig):
    rig.joints(PERIOD_NS)
    broken = Image(width=4, height=4, encoding='rgb8', step=12, data=b'short')
    broken.header.stamp = Time(nanosec=PERIOD_NS)
    info = encode_camera_info(broken.header, 4, 4, 4.0)
    rig.publishers[CAMERA_INFO.name].publish(info)
    rig.publishers[IMAGE.name].publish(broken)
    assert 'image_raw: 5 bytes of data' in rig.diagnosis('image_raw').message
    rig.joints(2 * PERIOD_NS)
    rig.image(2 * PERIOD_NS, room())
    assert to_ns(rig.answer().header.stamp) == 2 * PERIOD_NS


def test_annotated_image_only_for_a_subscriber(rig):
    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, caregiver_and_ball())
    rig.answer()
    rig.listen(IMAGE_ANNOTATED)
    rig.wait(lambda: rig.detector._annotated_publisher.get_subscription_count())
    rig.joints(2 * PERIOD_NS)
    rig.image(2 * PERIOD_NS, caregiver_and_ball())
    rig.wait(lambda: rig.all_of(IMAGE_ANNOTATED))
    (drawn,) = rig.all_of(IMAGE_ANNOTATED)
    assert to_ns(drawn.header.stamp) == 2 * PERIOD_NS
    assert np.unique(decode_image(drawn).reshape(-1, 3), axis=0).shape[0] > 50


def test_compressed_images_by_parameter(ros_context):
    rig = Rig(ros_context, compressed=True)
    jpeg = cv2.imencode('.jpg', caregiver_and_ball()[..., ::-1])[1]
    topic = IMAGE_COMPRESSED
    publisher = rig.node.create_publisher(topic.type, topic.name, topic.publisher_qos)
    rig.wait(publisher.get_subscription_count)
    rig.joints(PERIOD_NS)
    info = encode_camera_info(Header(), 320, 240, FOCAL_PX)
    rig.publishers[CAMERA_INFO.name].publish(info)
    message = CompressedImage(format='jpeg', data=jpeg.tobytes())
    message.header.stamp = to_time(PERIOD_NS)
    publisher.publish(message)
    face, ball = decode_detections(rig.answer())
    assert face.attended
    assert (ball.u, ball.v) == pytest.approx((280, 60), abs=1)
    rig.close()


def test_smaller_calibration_is_scaled_to_the_image(rig):
    rig.joints(PERIOD_NS)
    header = Header(stamp=to_time(PERIOD_NS))
    rig.publishers[CAMERA_INFO.name].publish(encode_camera_info(header, 160, 120, FOCAL_PX / 2))
    rig.publishers[IMAGE.name].publish(encode_image(caregiver_and_ball(), header.stamp, 'eye'))
    _, ball = decode_detections(rig.answer())
    assert ball.ray == pytest.approx((120.5 / FOCAL_PX, -59.5 / FOCAL_PX), abs=0.003)


def test_bad_parameter_is_refused_and_changes_nothing(rig):
    (result,) = rig.detector.set_parameters([Parameter('alpha_col', value=-1.0)])
    assert not result.successful
    assert rig.detector.get_parameter('alpha_col').value == 1.0


def test_alpha_changes_while_running(rig):
    (result,) = rig.detector.set_parameters([Parameter('alpha_col', value=0.0)])
    assert result.successful
    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, caregiver_and_ball())
    assert [d.kind for d in decode_detections(rig.answer())] == [Kind.FACE]


@pytest.mark.parametrize('turns', [1, 2, 3])
def test_a_camera_that_hangs_turned_gives_the_detections_of_an_upright_one(ros_context, turns):
    rig = Rig(ros_context, image_rotation_deg=90 * turns)
    publishers = rig.publishers.values()
    rig.wait(lambda: all(p.get_subscription_count() for p in publishers))
    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, np.ascontiguousarray(np.rot90(caregiver_and_ball(), turns)), FOCAL_PX)
    message = rig.answer()
    face, ball = decode_detections(message)
    rig.close()
    assert face.attended
    assert (ball.u, ball.v) == pytest.approx((280, 60), abs=1)
    assert ball.ray == pytest.approx((120.5 / FOCAL_PX, -59.5 / FOCAL_PX), abs=0.003)
    assert message.header.frame_id == 'eye_upright'


def test_rays_of_a_fisheye_are_those_of_opencv(rig):
    rig.joints(PERIOD_NS)
    header = Header(stamp=to_time(PERIOD_NS))
    info = encode_camera_info(header, 320, 240, 130.0)
    info.distortion_model, info.d = 'equidistant', [0.02, -0.01, 0.003, 0.001]
    rig.publishers[CAMERA_INFO.name].publish(info)
    rig.publishers[IMAGE.name].publish(encode_image(caregiver_and_ball(), header.stamp, 'eye'))
    ball = decode_detections(rig.answer())[-1]
    pixel = np.array([[[ball.u, ball.v]]])
    expected = cv2.fisheye.undistortPoints(pixel, np.reshape(info.k, (3, 3)), np.array(info.d))
    assert ball.ray == pytest.approx(expected.ravel(), abs=1e-5)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        (dict(distortion_model='omnidirectional', d=[0.1] * 4), "'omnidirectional' is not known"),
        (dict(d=[0.1] * 3), 'D holds 3 numbers'),
        (dict(d=[float('nan')] * 5), 'not finite'),
    ],
)
def test_a_calibration_that_cannot_be_obeyed_is_named(rig, changes, reason):
    info = encode_camera_info(Header(), 320, 240, FOCAL_PX)
    for name, value in changes.items():
        setattr(info, name, value)
    rig.publishers[CAMERA_INFO.name].publish(info)
    status = rig.diagnosis(reason)
    assert status.level == b'\x02'
    assert 'camera_info: ' in status.message


def test_a_calibration_for_another_shape_is_refused_and_not_stretched(rig):
    rig.joints(PERIOD_NS)
    header = Header(stamp=to_time(PERIOD_NS))
    rig.publishers[CAMERA_INFO.name].publish(encode_camera_info(header, 320, 180, FOCAL_PX))
    rig.publishers[IMAGE.name].publish(encode_image(room(), header.stamp, 'eye'))
    text = rig.diagnosis('another shape').message
    assert 'the images are 320x240, but camera_info is for 320x180' in text


def test_pictures_that_show_nothing_are_reported(rig, monkeypatch):
    monkeypatch.setattr('ja_common.core.picture_watch._BLIND_AFTER_S', 0.0)
    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, np.full((240, 320, 3), 3, np.uint8))
    status = rig.diagnosis('nearly black')
    assert status.level == b'\x01'
    assert 'lens covered' in status.message


def test_dark_samples_of_12_bits_are_seen(rig):
    rig.joints(PERIOD_NS)
    info = encode_camera_info(Header(), 320, 240, FOCAL_PX)
    rig.publishers[CAMERA_INFO.name].publish(info)
    wide = np.ascontiguousarray(caregiver_and_ball()[..., ::-1]).astype('<u2') << 4
    message = Image(width=320, height=240, encoding='bgr16', step=1920, data=wide.tobytes())
    message.header.stamp = to_time(PERIOD_NS)
    rig.publishers[IMAGE.name].publish(message)
    assert [d.kind for d in decode_detections(rig.answer())] == [Kind.FACE, Kind.OBJECT]


@pytest.fixture
def gaze_rig(ros_context):
    rig = Rig(ros_context, read_gaze=True)
    rig.listen(FACE_GAZE)
    rig.wait(lambda: rig.publishers[IMAGE.name].get_subscription_count())
    yield rig
    rig.close()


def test_gaze_of_an_attended_face_comes_before_the_detections(gaze_rig, monkeypatch):
    rig, order = gaze_rig, []
    for name in ('_face_gaze_publisher', '_detections_publisher'):
        publisher = getattr(rig.detector, name)

        def publish(message, name=name, publish=publisher.publish):
            order.append((name, to_ns(message.header.stamp)))
            publish(message)

        monkeypatch.setattr(publisher, 'publish', publish)
    rig.joints(PERIOD_NS, speed=0.5)
    rig.image(PERIOD_NS, caregiver_and_ball())
    assert not caregiver_face(decode_detections(rig.answer())).gaze_read
    assert order == [('_detections_publisher', PERIOD_NS)]
    rig.joints(2 * PERIOD_NS)
    rig.image(2 * PERIOD_NS, caregiver_and_ball())
    face = caregiver_face(decode_detections(rig.answer(2)))
    assert face.attended
    assert face.gaze_read
    assert [name for name, stamp_ns in order if stamp_ns == 2 * PERIOD_NS] == [
        '_face_gaze_publisher',
        '_detections_publisher',
    ]
    rig.wait(lambda: rig.all_of(FACE_GAZE))
    (message,) = rig.all_of(FACE_GAZE)
    assert to_ns(message.header.stamp) == 2 * PERIOD_NS
    gaze = decode_face_gaze(message)
    assert np.abs(gaze.head).max() < np.radians(30)
    assert gaze.visible.any()


def test_landmarks_are_published_while_a_subscriber_exists(gaze_rig):
    rig = gaze_rig
    rig.listen(FACE_LANDMARKS)
    rig.wait(lambda: rig.detector.count_subscribers(FACE_LANDMARKS.name))
    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, caregiver_and_ball())
    rig.wait(lambda: rig.all_of(FACE_LANDMARKS))
    (message,) = rig.all_of(FACE_LANDMARKS)
    assert to_ns(message.header.stamp) == PERIOD_NS
    columns = decode_columns(message, ('u', 'v'))
    assert len(columns['u']) >= 468 + 5
    assert columns['u'].mean() == pytest.approx(160, abs=15)
    assert columns['v'].mean() == pytest.approx(130, abs=15)


def test_a_face_whose_gaze_is_not_asked_for_is_not_read(rig):
    rig.listen(FACE_GAZE)
    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, caregiver_and_ball())
    face = caregiver_face(decode_detections(rig.answer()))
    assert face.attended
    assert not face.gaze_read
    assert not rig.all_of(FACE_GAZE)


def test_an_opencv_that_cannot_read_the_landmarks_is_named_and_detections_go_on(
    ros_context, monkeypatch
):
    read = cv2.dnn.readNetFromONNX

    def refuse(content):
        if content.size > 1_000_000:
            raise cv2.error('Unsupported operation')
        return read(content)

    monkeypatch.setattr(cv2.dnn, 'readNetFromONNX', refuse)
    rig = Rig(ros_context, read_gaze=True)
    try:
        rig.wait(lambda: rig.publishers[IMAGE.name].get_subscription_count())
        rig.joints(PERIOD_NS)
        rig.image(PERIOD_NS, caregiver_and_ball())
        face = caregiver_face(decode_detections(rig.answer()))
        assert face.attended
        assert not face.gaze_read
        status = rig.diagnosis('cannot read face_landmark.onnx')
        assert status.level == b'\x01'
        assert 'install OpenCV 4.6 or newer' in status.message
    finally:
        rig.close()


def test_health_states_who_is_seen(rig):
    def people():
        return rig.detector.health.values['people']

    rig.joints(PERIOD_NS)
    rig.image(PERIOD_NS, room())
    rig.answer()
    assert people() == 'I see no person, for 0 s'
    for count in range(2, 6):
        rig.joints(count * PERIOD_NS)
        rig.image(count * PERIOD_NS, caregiver_and_ball())
        rig.answer(count)
    assert people() == 'I see the caregiver'
    later = 60 * PERIOD_NS
    for count, stamp_ns in ((6, later), (7, later + 20 * PERIOD_NS)):
        rig.joints(stamp_ns)
        rig.image(stamp_ns, room())
        rig.answer(count)
    assert people().startswith('I see no person, for')
