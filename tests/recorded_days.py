"""A recording for tests: looks at a caregiver, and fixations of the attended object."""

import numpy as np

from ja_common.core.detection import Detection, Kind
from ja_common.core.geometry import rays_of_directions
from ja_common.core.stamps import NS_PER_S
from ja_common.detection_codec import encode_detections
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.point_cloud_codec import encode_columns
from ja_common.topics import DETECTIONS, FACE_IMAGE, FIXATION, JOINT_STATES, SIM_TRUTH
from ja_recording.core.reader import Recording
from ja_sim.truth_codec import FIELDS
from node_bench import header
from recordings import write_recording

LOOK = np.zeros(2)
JOINTS = JointCodec(JointConfig())
TRIALS = 40


def day(count: int = TRIALS) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return trials: the face (a bright column shows the gaze), attended and other direction."""
    rng = np.random.default_rng(0)
    trials = []
    for _ in range(count):
        attended = np.array([rng.uniform(-0.25, 0.25), 0.1])
        face = np.full((30, 25), 100, np.uint8)
        column = int(12 + 40 * attended[0])
        face[:, column - 1 : column + 2] = 250
        trials.append((face, attended, np.array([-attended[0] + 0.1, -0.1])))
    return trials


def messages_of(trials, with_truth: bool = True):
    """Yield the messages of two images a trial: the look, the fixation of the attended object."""
    for number, (face, attended, other) in enumerate(trials):
        for part, posture in enumerate((LOOK, attended)):
            stamp_ns = (2 * number + part) * NS_PER_S // 10
            head = header(stamp_ns)
            if with_truth:
                columns = np.zeros((len(FIELDS), 2))
                columns[FIELDS.index('pan')] = attended[0], other[0]
                columns[FIELDS.index('tilt')] = attended[1], other[1]
                columns[FIELDS.index('attended')] = 1, 0
                columns[FIELDS.index('trial')] = number + 1
                truth = encode_columns(head, dict(zip(FIELDS, columns, strict=True)))
                yield stamp_ns, SIM_TRUTH, truth
            yield stamp_ns, JOINT_STATES, JOINTS.encode(head, posture, np.zeros(2))
            seen = [detected(Kind.OBJECT, posture, each) for each in (attended, other)]
            if part == 0:
                yield stamp_ns, FACE_IMAGE, encode_image(face, head.stamp, '')
                seen.append(detected(Kind.FACE, posture, LOOK))
            yield stamp_ns, DETECTIONS, encode_detections(head, seen)
            yield stamp_ns, FIXATION, JOINTS.encode(head, attended if part else None)


def detected(kind: Kind, posture, direction) -> Detection:
    x, y = map(float, rays_of_directions(posture, direction))
    return Detection(kind, x, y, 0.0, 0.0, 9.0, 9.0, 1.0, attended=kind is Kind.FACE)


def recorded(path, count: int = TRIALS, **kwargs) -> Recording:
    return Recording(write_recording(path, messages_of(day(count), **kwargs)))
