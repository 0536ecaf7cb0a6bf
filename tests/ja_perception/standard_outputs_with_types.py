"""The nodes with the real vision_msgs, hri_msgs and tf2_msgs, over real topics.

`test_standard_outputs_types.py` builds the types and runs this file, which needs them.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from ja_common.core.geometry import head_rotation
from ja_common.topics import DETECTIONS, FACE_GAZE, FACE_LANDMARKS, IMAGE, JOINT_STATES, Topic
from ja_common.transforms import tf_topics
from ja_control.head_frames_node import HeadFramesNode
from ja_perception.standard_codec import HriTypes, VisionTypes
from ja_perception.standard_outputs_node import StandardOutputsNode
from seen_faces import BALL, FACE, IN, READ, publish
from standard_stand_ins import HRI, VISION

TF, TF_STATIC = tf_topics()
FACES = '/humans/faces'


def topic(name, message_type):
    return Topic(name, message_type, '', *[TF.publisher_qos] * 2)


def rotation_of(transform):
    q = transform.transform.rotation
    return Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()


def test_the_stand_ins_have_the_fields_of_the_real_classes():
    for real, stand_ins in ((VisionTypes.find(), VISION), (HriTypes.find(), HRI)):
        for part, stand_in in vars(stand_ins).items():
            assert set(stand_in.fields) == set(getattr(real, part).get_fields_and_field_types())


def test_all_outputs_arrive(make_bench):
    hri = HriTypes.find()
    types = {
        'detections_2d': VisionTypes.find().array,
        f'{FACES}/tracked': hri.ids,
        f'{FACES}/f3/roi': hri.region,
        f'{FACES}/f3/cropped': IMAGE.type,
        f'{FACES}/f3/landmarks': hri.landmarks,
    }
    topics = [topic(name, message_type) for name, message_type in types.items()]
    bench = make_bench(StandardOutputsNode, IN, [])
    for each in [*topics, TF]:
        keep = bench.messages(each).append
        bench.peer.create_subscription(each.type, each.name, keep, each.subscriber_qos)
    index = 0

    def all_came():
        nonlocal index
        index += 1
        publish(bench, index, [BALL, READ], reading=True)
        return all(bench.messages(each) for each in [*topics, TF])

    bench.wait(all_came)
    array, tracked, roi, cropped, landmarks = (bench.messages(each)[-1] for each in topics)
    assert [each.id for each in array.detections] == ['12', 'f3']
    assert array.detections[1].results[0].hypothesis.class_id == 'face'
    assert tracked.ids == ['f3']
    assert np.isclose(roi.xmin, 30.5 / 80)
    assert (cropped.width, cropped.height) == (128, 128)
    assert (landmarks.width, landmarks.landmarks[0].c) == (80, np.float32(0.9))
    face, gaze = bench.messages(TF)[-1].transforms
    assert (face.child_frame_id, gaze.child_frame_id) == ('face_f3', 'gaze_f3')
    assert face.header.frame_id == 'camera_optical_frame'
    assert np.allclose(rotation_of(face)[:, 0], rotation_of(gaze)[:, 2])
    position = np.array([getattr(face.transform.translation, axis) for axis in 'xyz'])
    assert np.allclose(rotation_of(face)[:, 0], -position)  # 1 m away, it faces the camera


def test_a_face_that_is_gone_takes_its_topics_along(make_bench):
    bench = make_bench(StandardOutputsNode, IN, [], topics_kept_s=0.0)
    names = lambda: {name for name, _ in bench.peer.get_topic_names_and_types()}  # noqa: E731
    publish(bench, 1, [FACE])
    bench.wait(lambda: f'{FACES}/f3/roi' in names())
    publish(bench, 2, [])
    bench.wait(lambda: f'{FACES}/f3/roi' not in names())


def test_the_head_publishes_its_transforms(make_bench):
    bench = make_bench(
        HeadFramesNode, [JOINT_STATES], [TF, TF_STATIC], urdf='pan_tilt', image_rotation_deg=90
    )
    bench.publish_posture(10**8, 0.3, -0.2)
    pan, tilt = bench.next(TF).transforms
    assert (pan.header.frame_id, pan.child_frame_id) == ('base_link', 'pan_link')
    assert (tilt.header.frame_id, tilt.child_frame_id) == ('pan_link', 'tilt_link')
    turned = rotation_of(pan) @ rotation_of(tilt)
    assert np.allclose(turned, head_rotation([0.3, -0.2]), rtol=0.0, atol=1e-9)
    bench.wait(lambda: bench.messages(TF_STATIC))
    fixed = {each.child_frame_id: each for each in bench.messages(TF_STATIC)[-1].transforms}
    assert list(fixed) == ['camera_link', 'camera_optical_frame', 'camera_optical_frame_upright']
    # Turned clockwise by 90 degrees, what was down in the picture is on the left of it.
    upright = rotation_of(fixed['camera_optical_frame_upright'])
    assert np.allclose(upright.T @ [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0])
    assert 'tf and tf_static are published' in bench.node.health.values['transforms']


def test_what_is_read_is_the_same_with_the_real_types(make_bench):
    """Nothing is missing, so nothing is stated to be."""
    node = make_bench(StandardOutputsNode).node
    for package in ('vision_msgs', 'hri_msgs', 'tf2_msgs'):
        assert 'not installed' not in node.health.values[package]
    assert {DETECTIONS, FACE_GAZE, FACE_LANDMARKS, IMAGE} <= {*node.subscribed_topics.values()}
