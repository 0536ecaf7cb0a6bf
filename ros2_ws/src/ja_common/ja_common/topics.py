"""Every topic and service of the graph: its name, type, quality of service and purpose.

Names are relative, so namespaces and remaps work. `docs/topics.md` is made from this table.
"""

from dataclasses import dataclass, replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PointStamped, PoseStamped
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, PointCloud2
from std_msgs.msg import Float32, Float64MultiArray, Header, String
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray


def _qos(reliable: bool, depth: int, latched: bool = False) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


@dataclass(frozen=True, eq=False)  # compared by identity, so that a topic can be a key
class Topic:
    """One topic: its publishers use `publisher_qos`, its subscribers `subscriber_qos`."""

    name: str
    type: Any
    purpose: str
    publisher_qos: QoSProfile
    subscriber_qos: QoSProfile


# Sensors publish reliably, and we subscribe best-effort, so that any camera or rig driver matches.
# Images have depth 1: an old picture is of no use.
_PICTURE = {'publisher_qos': _qos(True, 1), 'subscriber_qos': _qos(False, 1)}
# Joint states come several to an image, and interpolation wants them all.
_SENSOR = {'publisher_qos': _qos(True, 50), 'subscriber_qos': _qos(False, 50)}
# Between our own nodes nothing may be lost: one message an image, on every topic.
_LINK = {'publisher_qos': _qos(True, 10), 'subscriber_qos': _qos(True, 10)}
# For people and tools that start later and want the last message.
_LATCHED = {
    'publisher_qos': _qos(True, 1, latched=True),
    'subscriber_qos': _qos(True, 1, latched=True),
}

IMAGE = Topic('image_raw', Image, 'picture of the head camera', **_PICTURE)
IMAGE_COMPRESSED = Topic(
    'image_raw/compressed', CompressedImage, 'the same as JPEG or PNG, from rigs', **_PICTURE
)
WIDE_IMAGE = Topic(
    'wide/image_raw', Image, 'wide picture in which the digital head moves its window', **_PICTURE
)
CAMERA_INFO = Topic('camera_info', CameraInfo, 'intrinsics of the head camera', **_PICTURE)
DEPTH = Topic(
    'depth/image_raw',
    Image,
    'distances along the optical axis, registered to image_raw (REP-118: 16UC1 [mm], 32FC1 [m])',
    **_PICTURE,
)
RIGHT_IMAGE = Topic(
    'right/image_raw', Image, 'picture of a second camera to the right of the first', **_PICTURE
)
RIGHT_CAMERA_INFO = Topic(
    'right/camera_info',
    CameraInfo,
    'intrinsics of the second camera; its P has the baseline',
    **_PICTURE,
)
JOINT_STATES = Topic('joint_states', JointState, 'measured posture of the head', **_SENSOR)
DETECTIONS = Topic(
    'detections', PointCloud2, 'objects and faces of one image, empty ones too', **_LINK
)
TARGET = Topic(
    'salient_feature_detector/target',
    PointStamped,
    'ray to the most salient object (Eq. 1); while subscribed',
    **_LINK,
)
FACE = Topic(
    'salient_feature_detector/face',
    PointStamped,
    "ray to the caregiver's face; while subscribed",
    **_LINK,
)
FACE_IMAGE = Topic(
    'face_image', Image, "the caregiver's face, 30 rows x 25 columns, while attended", **_LINK
)
FACE_GAZE = Topic(
    'face_gaze',
    PointCloud2,
    'head pose and eye-in-head angles of the attended face, by landmarks; one point a look',
    **_LINK,
)
FACE_LANDMARKS = Topic(
    'face_landmarks',
    PointCloud2,
    'landmarks of the attended face in the image: u, v [px]; published while a subscriber exists',
    **_LINK,
)
IMAGE_ANNOTATED = Topic(
    'image_annotated',
    Image,
    'the picture with the detections drawn in; published while a subscriber exists',
    **_PICTURE,
)
WEIGHT_FILES = Topic(
    'weight_files',
    DiagnosticStatus,
    'files of learned weights that the eyes of this graph have opened: name -> SHA-256',
    **_LATCHED,
)
VF_DELTA = Topic(
    'visual_feedback/delta', JointState, 'change of posture towards the target (Eq. 2)', **_LINK
)
FACE_DELTA = Topic(
    'visual_feedback/face_delta',
    JointState,
    "change of posture towards the caregiver's face (Eq. 2)",
    **_LINK,
)
LM_DELTA = Topic(
    'learning_module/delta', JointState, 'change of posture that the learner proposes', **_LINK
)
GLANCE_DELTA = Topic(
    'learning_module/glance_delta',
    JointState,
    'change of posture to a view that the learner wants a glance at before the shift',
    **_LINK,
)
EVIDENCE = Topic(
    'learning_module/evidence',
    PointCloud2,
    'one point: `log_evidence` [nats] that the learner does better than chance, and '
    '`expected_gain`, 0 to 1, by its own belief (NaN: unknown)',
    **_LINK,
)
BELIEF = Topic(
    'learning_module/belief',
    PointCloud2,
    'samples of where the learner believes she looks: pan, tilt, weight; while subscribed',
    **_LINK,
)
TRACK = Topic(
    'learning_module/track',
    String,
    'what the learner starts from: strict, self-supervised, synthetic others or landmarks, each '
    'with depth once it has used ranges',
    **_LATCHED,
)
FIXATION = Topic(
    'fixation',
    JointState,
    'direction of the object that stands in the centre of a still view (Eq. 3)',
    **_LINK,
)
JOINT_COMMANDS = Topic(
    'joint_commands', JointState, 'absolute posture that the head takes next, limited', **_LINK
)
JOINT_TRAJECTORY = Topic(
    'joint_trajectory_controller/joint_trajectory',
    JointTrajectory,
    'the same for a ros2_control joint_trajectory_controller, where configured',
    **_LINK,
)
FORWARD_COMMANDS = Topic(
    'forward_position_controller/commands',
    Float64MultiArray,
    'the same for a ros2_control forward_command_controller, where configured',
    **_LINK,
)
ROBOT_DESCRIPTION = Topic(
    'robot_description',
    String,
    'URDF of the head: its frames and, where so configured, the joint limits of the gate',
    **_LATCHED,
)
CAMERA_POSE = Topic(
    'head/camera_pose',
    PoseStamped,
    'where the optical frame of the camera is in the base frame, by the URDF and joint_states',
    **_SENSOR,
)
GATE_STATUS = Topic(
    'gate/status', DiagnosticStatus, 'phase, source, p(LM), limits, reason of a hold', **_LINK
)
INTERRUPTED = Topic(
    'gate/interrupted',
    Header,
    'while the head is held, turns home or looks at a point of `look_at`: stamp of each image; a '
    'trial with a look at this stamp or before is none',
    **_LINK,
)
LOOK_AT = Topic(
    'look_at',
    PointStamped,
    'point to look at [m], in the base frame or the optical frame of the camera',
    publisher_qos=_qos(True, 10),
    subscriber_qos=_qos(False, 10),
)
MARKERS = Topic(
    'markers',
    MarkerArray,
    'rays, labels, field of view, belief and directions for RViz and Foxglove; while subscribed',
    **_LINK,
)
DIAGNOSTICS = Topic('/diagnostics', DiagnosticArray, 'health of every node, 1 Hz', **_LINK)
LOG = Topic(
    '/rosout',
    Log,
    'what every node logs',
    publisher_qos=_qos(True, 1000),
    subscriber_qos=_qos(True, 1000),
)
CLOCK = Topic(
    '/clock', Clock, 'simulated time', publisher_qos=_qos(True, 10), subscriber_qos=_qos(False, 1)
)
SIM_TRUTH = Topic('sim/truth', PointCloud2, 'where everything is and what she attends to', **_LINK)
SUCCESS_RATE = Topic(
    'sim/success_rate', Float32, 'share of recent trials with joint attention', **_LATCHED
)
SCORE = Topic('sim/score', DiagnosticStatus, 'the score in full, after every trial', **_LATCHED)
CAREGIVER_REQUEST = Topic(
    'caregiver/request',
    DiagnosticStatus,
    'what a real caregiver is asked to look at, the numbered things, the score: for the page only',
    **_LATCHED,
)

EVERY_SCORE = replace(
    SCORE, subscriber_qos=QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
)
"""`SCORE` for a subscriber that counts the trials: no message may be lost."""

OLD_TARGET = replace(TARGET, name='target', purpose=f'old name of `{TARGET.name}`')
OLD_FACE = replace(FACE, name='face', purpose=f'old name of `{FACE.name}`')

NEW_NAMES = {OLD_TARGET.name: TARGET.name, OLD_FACE.name: FACE.name}
"""Old names of topics, which work for one more release, and the new ones."""

TOPICS = tuple(
    value
    for value in list(globals().values())
    if isinstance(value, Topic) and value is not EVERY_SCORE
)
