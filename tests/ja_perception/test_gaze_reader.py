"""Head pose and eyes by landmarks, on rendered people whose angles are known."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Kind
from ja_common.core.face_gaze import LEFT, RIGHT
from ja_common.core.geometry import directions_of_rays, rays_of_directions
from ja_common.core.posture import Posture
from ja_perception.core import head_pose
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.box import Box
from ja_perception.core.detector import SalientFeatureDetector
from ja_perception.core.face_tracking import search_square, whole_square
from ja_perception.core.gaze_reader import GazeReader, GazeReading
from ja_perception.core.landmark_networks import TurnedSquare
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld
from synthetic_pictures import room

SIZE = (640, 480)
CAMERA = CameraModel.from_field_of_view(*SIZE, np.radians(36))
FINDER = BlazeFace()
# Not one of the people to whom the constants of the reader were fitted.
PERSON = 'efua'
STEP_NS = 100_000_000

Render = Callable[..., np.ndarray]


@pytest.fixture(scope='module')
def render() -> Iterator[Render]:
    """Return a picture for head and eyes in degrees, with the signs of `FaceGaze`."""
    scene = load_scene('default')
    caregiver = replace(scene.caregiver, identity=PERSON)
    world = JointAttentionWorld(replace(scene, caregiver=caregiver), 3, SIZE)

    def picture(yaw=0.0, pitch=0.0, eyes=(0.0, 0.0), closed=False):
        # Her left is the robot's right.
        head, eye = np.radians([-yaw, pitch]), np.radians([-eyes[0], eyes[1]])
        return world.render_picture(head, closed, np.stack([eye, eye]))

    yield picture
    world.close()


@pytest.fixture(scope='module')
def reader() -> GazeReader:
    return GazeReader()


def face_box(picture: np.ndarray) -> Box:
    height, width = picture.shape[:2]
    whole = whole_square(width, height)
    (face,) = FINDER.find_faces(picture, whole)
    (again,) = FINDER.find_faces(picture, search_square(face.box, whole))
    return again.box


def read(reader: GazeReader, picture: np.ndarray, camera=CAMERA) -> GazeReading | None:
    return reader.read(picture, face_box(picture), camera)


def test_a_turned_head_gives_its_angles(reader, render):
    # In pitch each person has a constant of her own, see docs/senses.md.
    own = np.degrees(read(reader, render(0, 0)).gaze.head[1])
    assert abs(own) < 10
    for yaw, pitch in ((0, 0), (25, 0), (-25, 0), (0, 15), (0, -15), (-35, 10)):
        reading = read(reader, render(yaw, pitch))
        found = np.degrees(reading.gaze.head)
        assert found[0] == pytest.approx(yaw, abs=5), (yaw, pitch, found)
        assert found[1] - own == pytest.approx(pitch, abs=5), (yaw, pitch, found)
        assert found[2] == pytest.approx(0, abs=5)
        assert reading.landmarks.shape[1] == 2
        assert len(reading.landmarks) == 468 + 5 * reading.gaze.visible.sum()


def test_an_image_that_is_turned_gives_the_roll(reader, render):
    centre = ((SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2)
    upright = read(reader, render(15, 0)).gaze.head
    for clockwise in (20, -20):
        turn = cv2.getRotationMatrix2D(centre, -clockwise, 1)
        picture = cv2.warpAffine(render(0, 0), turn, SIZE)
        head = np.degrees(read(reader, picture).gaze.head)
        assert head == pytest.approx([0, 0, clockwise], abs=8)
    assert np.degrees(upright[2]) == pytest.approx(0, abs=5)


def test_eyes_give_the_sign_and_most_of_the_angle(reader, render):
    right, ahead, left = (
        read(reader, render(eyes=(yaw, 0))).gaze.eyes[:, 0] for yaw in (-20, 0, 20)
    )
    for turned in (np.degrees(left - ahead), np.degrees(ahead - right)):
        assert turned.min() > 10
        assert turned.max() < 30
    up, down = (read(reader, render(eyes=(0, pitch))).gaze.eyes[:, 1] for pitch in (-15, 15))
    assert np.degrees(down - up).min() > 4


def test_the_far_eye_is_hidden_and_the_near_one_is_not(reader, render):
    # Turned to the left of the image, she hides her right eye.
    assert list(read(reader, render(38)).gaze.visible) == [True, False]
    assert list(read(reader, render(-38)).gaze.visible) == [False, True]
    gaze = read(reader, render(0)).gaze
    assert gaze.visible.all()
    assert gaze.eyes[LEFT] == pytest.approx(gaze.eyes[RIGHT], abs=np.radians(8))


def test_a_mirrored_picture_gives_the_mirrored_reading(reader, render):
    picture = render(20, 5, eyes=(-10, 5))
    mirrored = np.ascontiguousarray(picture[:, ::-1])
    expected, found = read(reader, picture).gaze.mirrored(), read(reader, mirrored).gaze
    assert found.head == pytest.approx(expected.head, abs=np.radians(3))
    assert found.eyes == pytest.approx(expected.eyes, abs=np.radians(5))
    assert found.head[0] < -0.2


def test_a_blink_gives_nothing(reader, render):
    for yaw, pitch in ((0, 0), (20, 5), (-30, -10)):
        assert read(reader, render(yaw, pitch)) is not None
        assert read(reader, render(yaw, pitch, closed=True)) is None


def test_a_blink_in_a_grey_picture_gives_nothing(reader, render):
    for closed in (False, True):
        grey = cv2.cvtColor(render(5, 0, closed=closed), cv2.COLOR_RGB2GRAY)
        reading = read(reader, cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB))
        assert (reading is None) is closed


def test_a_head_turned_far_gives_nothing(reader, render):
    for yaw in (65, -65):
        assert read(reader, render(yaw)) is None


def test_no_face_gives_nothing(reader):
    assert reader.read(room(640, 480), Box(320, 240, 100, 100), CAMERA) is None


def test_uncertainty_grows_with_the_turn_and_with_smaller_faces(reader, render):
    ahead, turned = read(reader, render(0)).gaze, read(reader, render(35)).gaze
    small_camera = CAMERA.resized(320, 240)
    small = cv2.resize(render(0), (320, 240), interpolation=cv2.INTER_AREA)
    far = read(reader, small, small_camera).gaze
    for one, other in ((ahead, turned), (ahead, far)):
        assert one.head_deviation_rad < other.head_deviation_rad < np.radians(10)
        assert one.eye_deviation_rad < other.eye_deviation_rad < np.radians(15)
    assert far.head == pytest.approx(ahead.head, abs=np.radians(4))


def test_the_pose_is_relative_to_the_ray_to_the_face():
    """A head at the side of a wide view that faces the camera: zero, not the ray's angle."""
    camera = CameraModel.from_field_of_view(640, 480, np.radians(90))
    direction = np.radians([25.0, 10.0])
    middle = camera.pixels(rays_of_directions((0.0, 0.0), direction))
    landmarks = synthetic_landmarks(camera, direction)
    pose = head_pose.fit_head_pose(landmarks, camera)
    assert pose.direction == pytest.approx(direction, abs=0.02)
    assert np.degrees(pose.angles) == pytest.approx([0, 0, 0], abs=1.0)
    assert middle[0] < 320


def synthetic_landmarks(camera: CameraModel, direction: np.ndarray) -> np.ndarray:
    """Return where the reference points of a small face at ``direction`` are seen (468, 3)."""
    landmarks = np.zeros((468, 3))
    size = 0.02
    along = size * (head_pose._POINTS - head_pose._POINTS.mean(axis=0))
    rays = directions_of_rays(direction, along[:, :2])
    landmarks[head_pose._INDICES, :2] = camera.pixels(rays_of_directions((0.0, 0.0), rays))
    landmarks[head_pose._INDICES, 2] = camera.fx * along[:, 2]
    return landmarks


def test_a_turned_square_is_cut_and_mapped_back():
    picture = np.zeros((100, 120, 3), np.uint8)
    picture[40, 70] = 255
    square = TurnedSquare(68.0, 42.0, 32.0, 0.3)
    for each in (square, square._replace(mirrored=True)):
        cut = each.cut_from(picture, 64)[..., 0]
        v, u = np.unravel_index(cut.argmax(), cut.shape)
        assert each.to_image(np.array([[u, v]], float), 64)[0] == pytest.approx([70, 40], abs=0.5)


class CountingReader:
    """A reader that counts its readings."""

    def __init__(self, reader: GazeReader) -> None:
        self._reader = reader
        self.count = 0

    def read(self, image, face_box, camera):
        self.count += 1
        return self._reader.read(image, face_box, camera)


def at(stamp_ns: int, velocity=(0.0, 0.0)) -> Posture:
    return Posture(stamp_ns, np.zeros(2), np.array(velocity, float))


def test_only_an_attended_face_that_changed_is_read(reader, render):
    counting = CountingReader(reader)
    detector = SalientFeatureDetector(FINDER, gaze_reader=counting)
    ahead, aside = render(0), render(0, eyes=(15, 0))
    moving = detector.detect(ahead, STEP_NS, CAMERA, at(STEP_NS, (0.5, 0.0)))
    assert moving.face_gaze is None
    assert counting.count == 0
    first, again, other = (
        detector.detect(picture, n * STEP_NS, CAMERA, at(n * STEP_NS))
        for n, picture in ((2, ahead), (3, ahead), (4, aside))
    )
    assert counting.count == 2
    assert again.face_gaze is first.face_gaze is not None
    assert other.face_gaze.eyes[0, 0] > first.face_gaze.eyes[0, 0] + 0.1
    face = first.detections[0]
    assert face.kind is Kind.FACE
    assert face.gaze_read
    blink = detector.detect(render(0, closed=True), 5 * STEP_NS, CAMERA, at(5 * STEP_NS))
    assert blink.face_gaze is None
    assert blink.detections[0].attended
    assert not blink.detections[0].gaze_read


def test_without_a_reader_nothing_is_read(render):
    percept = SalientFeatureDetector(FINDER).detect(render(0), STEP_NS, CAMERA, at(STEP_NS))
    assert percept.detections[0].attended
    assert percept.face_gaze is None
    assert not percept.detections[0].gaze_read
