"""`head_frames`: the pose of the camera from the URDF and the joint states."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from ja_common.core.config import ConfigError
from ja_common.core.geometry import head_rotation
from ja_common.head_description import PAN_TILT_URDF
from ja_common.optional_types import find_type, how_to_install
from ja_common.time_codec import to_ns
from ja_common.topics import CAMERA_POSE, JOINT_STATES, ROBOT_DESCRIPTION
from ja_common.transforms import TF_TYPE
from ja_control.head_frames_node import HeadFramesNode
from node_bench import header

PERIOD_NS = 10**8
FORWARD = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def make_frames(make_bench):
    def make(**parameters):
        described = [] if parameters.get('urdf') else [ROBOT_DESCRIPTION]
        return make_bench(HeadFramesNode, [JOINT_STATES, *described], [CAMERA_POSE], **parameters)

    return make


def ahead_of(pose):
    """Return where the camera looks (3,) in the base frame."""
    q = pose.pose.orientation
    return Rotation.from_quat([q.x, q.y, q.z, q.w]).apply(FORWARD)


def test_the_pose_is_that_of_the_posture_at_its_stamp(make_frames):
    bench = make_frames(urdf='pan_tilt')
    for index, posture in enumerate([(0.3, -0.2), (-0.4, 0.1)], 1):
        bench.publish_posture(index * PERIOD_NS, *posture)
        pose = bench.next(CAMERA_POSE)
        assert to_ns(pose.header.stamp) == index * PERIOD_NS
        assert pose.header.frame_id == 'base_link'
        assert np.allclose(ahead_of(pose), head_rotation(posture)[:, 0])


def test_the_description_of_a_topic_counts(make_frames):
    """A camera 5 cm ahead of the tilt axis: the calibration of a rig stands in its URDF."""
    bench = make_frames()
    camera = '<child link="camera_link"/>\n    <origin xyz="'
    text = PAN_TILT_URDF.read_text()
    assert camera in text
    bench.publish(ROBOT_DESCRIPTION, String(data=text.replace(f'{camera}0', f'{camera}0.05')))

    def answered():
        bench.publish_posture(PERIOD_NS, 0.5, 0.2)
        return bench.messages(CAMERA_POSE)

    bench.wait(answered)
    point = bench.messages(CAMERA_POSE)[-1].pose.position
    assert np.allclose([point.x, point.y, point.z], 0.05 * head_rotation([0.5, 0.2])[:, 0])


def test_joints_may_come_one_by_one_and_among_others(make_frames):
    bench = make_frames(urdf='pan_tilt')
    for index, (names, positions) in enumerate(
        [(['wheel', 'pan'], [9.0, 0.5]), (['tilt'], [0.1]), (['pan'], [0.6])], 1
    ):
        message = JointState(header=header(index * PERIOD_NS), name=names, position=positions)
        bench.publish(JOINT_STATES, message)
    poses = [bench.next(CAMERA_POSE), bench.next(CAMERA_POSE)]
    assert [to_ns(pose.header.stamp) for pose in poses] == [2 * PERIOD_NS, 3 * PERIOD_NS]
    assert np.allclose(ahead_of(poses[-1]), head_rotation([0.6, 0.1])[:, 0])


def test_the_rate_is_limited_by_the_stamps(make_frames):
    bench = make_frames(urdf='pan_tilt', highest_rate_hz=5.0)
    for index in range(1, 6):
        bench.publish_posture(index * PERIOD_NS, 0.1 * index)
    bench.publish_posture(PERIOD_NS)  # a clock that was set back is no reason for silence
    bench.wait(lambda: len(bench.messages(CAMERA_POSE)) == 4)
    stamps = [to_ns(pose.header.stamp) // PERIOD_NS for pose in bench.messages(CAMERA_POSE)]
    assert stamps == [1, 3, 5, 1]


def test_bad_positions_are_reported_and_the_others_used(make_frames):
    bench = make_frames(urdf='pan_tilt')
    bench.publish_posture(PERIOD_NS, 0.1, 0.2)
    bench.next(CAMERA_POSE)
    bench.publish_posture(2 * PERIOD_NS, 0.3, math.nan)
    pose = bench.next(CAMERA_POSE)
    assert np.allclose(ahead_of(pose), head_rotation([0.3, 0.2])[:, 0])
    bench.wait_for_complaint("['tilt'] are not finite")
    bench.publish(
        JOINT_STATES, JointState(header=header(3 * PERIOD_NS), name=['pan'], position=[1.0, 2.0])
    )
    bench.wait_for_complaint('2 positions for 1 names')


def test_a_description_that_cannot_be_used_is_reported_and_the_next_one_used(make_frames):
    bench = make_frames()
    bench.wait_for_complaint('publish the URDF of the head, or set urdf')
    bench.publish(ROBOT_DESCRIPTION, String(data='<robot/>'))
    bench.wait_for_complaint('no <link>')
    bench.publish(ROBOT_DESCRIPTION, String(data='<robot><link name="base_link"/></robot>'))
    bench.wait_for_complaint("no link 'camera_optical_frame'")
    bench.publish(ROBOT_DESCRIPTION, String(data=PAN_TILT_URDF.read_text()))
    bench.wait(lambda: 'URDF of the head' not in bench.complaint())
    bench.publish_posture(PERIOD_NS)
    bench.next(CAMERA_POSE)


def test_missing_joints_are_reported(make_frames):
    bench = make_frames(urdf='pan_tilt', pan_joint='head_pan')
    bench.publish_posture(PERIOD_NS)
    bench.wait_for_complaint("has not stated ['head_pan']")


@pytest.mark.parametrize(
    ('parameters', 'complaint'),
    [
        ({'urdf': 'nowhere.urdf'}, 'nowhere.urdf'),
        ({'urdf': 'pan_tilt', 'camera_frame': 'eye'}, "no link 'eye'"),
        ({'image_rotation_deg': 45}, 'not one of 0, 90, 180, 270'),
    ],
)
def test_a_setting_that_cannot_be_used_ends_the_start(make_bench, parameters, complaint):
    with pytest.raises(ConfigError, match=complaint):
        make_bench(HeadFramesNode, **parameters)


def test_a_file_is_read_and_published(make_bench, tmp_path):
    path = tmp_path / 'head.urdf'
    path.write_text(PAN_TILT_URDF.read_text())
    bench = make_bench(HeadFramesNode, [], [ROBOT_DESCRIPTION], urdf=str(path))
    bench.wait(lambda: bench.messages(ROBOT_DESCRIPTION))
    assert bench.messages(ROBOT_DESCRIPTION)[0].data == path.read_text()


@pytest.mark.skipif(find_type(TF_TYPE) is not None, reason='tf2_msgs is installed')
def test_without_tf2_msgs_it_states_what_is_missing(make_frames):
    values = make_frames(urdf='pan_tilt').node.health.values
    assert how_to_install('tf2_msgs') in values['transforms']
