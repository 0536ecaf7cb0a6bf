"""The salient feature detector of Nagai, Hosoda and Asada (2003): one image in, detections out."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.camera_model import CameraModel
from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection, Kind, most_salient
from ja_common.core.face_gaze import FaceGaze
from ja_common.core.fixation import WIDTH_SIXTH, stands_in_centre
from ja_common.core.posture import STILL_BELOW_RAD_S, Posture
from ja_perception.core.box import Box
from ja_perception.core.face_crop import FACE_COLUMNS, FACE_ROWS, crop_face
from ja_perception.core.face_tracking import FaceConfig, FaceTrack, FaceTracker, PeopleSeen
from ja_perception.core.faces import FaceFinder
from ja_perception.core.features import FeatureConfig
from ja_perception.core.gaze_reader import GazeReader, GazeReading, StoredGaze
from ja_perception.core.grouping import GroupingConfig
from ja_perception.core.motion import MotionConfig
from ja_perception.core.object_tracking import TrackingConfig
from ja_perception.core.ranging import ImageRegion, RangeSensor, add_ranges, face_region
from ja_perception.core.salient_objects import InterestConfig, SalientObjects


@dataclass(frozen=True)
class AttentionConfig(Configuration):
    """When the face counts as attended, and how it is cut out for the learner."""

    d_th_rad: float = parameter(
        WIDTH_SIXTH, 'd_th of Eq. 3: how near to the centre a thing is attended to',
        low=0.0, high=1.0,
    )  # fmt: skip
    still_below_rad_s: float = parameter(
        STILL_BELOW_RAD_S, 'the head is still when both joints are slower', low=0.0, high=10.0
    )
    attended_within_s: float = parameter(
        0.2, 'a face that was not found for longer is held, but not attended to',
        low=0.0, high=10.0,
    )  # fmt: skip
    crop_widths: float = parameter(
        1.5, 'width of the face image (in widths of the face)', low=0.5, high=5.0
    )


@dataclass(frozen=True)
class DetectorConfig:
    """All parameters of the detector."""

    attention: AttentionConfig = field(default_factory=AttentionConfig)
    interest: InterestConfig = field(default_factory=InterestConfig)
    features: FeatureConfig = field(default_factory=FeatureConfig)
    motion: MotionConfig = field(default_factory=MotionConfig)
    grouping: GroupingConfig = field(default_factory=GroupingConfig)
    tracking: TrackingConfig = field(default_factory=TrackingConfig)
    faces: FaceConfig = field(default_factory=FaceConfig)


@dataclass(frozen=True)
class Percept:
    """The faces and objects of one image.

    ``detections``: the caregiver's face first, other faces, then objects, most salient first.
    While hers is not in view there are no faces among them, so that no other is taken for hers;
    they are in ``other_faces``. ``people``: who is there.
    ``face_image``: (30, 25) uint8 while the head attends to the caregiver, cut from
    ``face_image_box`` [px]; else both are None. ``gaze_reading``: of the same face, where its gaze
    is read. ``motion_judged``: False where motion could not be measured (alpha_mot = 0, the first
    images, a fast head). ``moving_share``: share of the image that moves.
    """

    detections: list[Detection]
    face_image: NDArray[np.uint8] | None
    face_image_box: Box | None
    motion_judged: bool
    moving_share: float
    gaze_reading: GazeReading | None = None
    people: PeopleSeen = field(default_factory=PeopleSeen)
    other_faces: list[Detection] = field(default_factory=list)

    @property
    def target(self) -> Detection | None:
        """Return the object i_trg of Eq. 1; None when no object is seen."""
        return most_salient(self.detections)

    @property
    def face_gaze(self) -> FaceGaze | None:
        """Return head pose and eyes of the attended face; None where they are not read."""
        return None if self.gaze_reading is None else self.gaze_reading.gaze


class SalientFeatureDetector:
    """Finds faces and salient objects in image after image; reads gaze with a ``gaze_reader``."""

    def __init__(
        self,
        finder: FaceFinder,
        config: DetectorConfig | None = None,
        gaze_reader: GazeReader | None = None,
    ) -> None:
        self._finder = finder
        self._config = config or DetectorConfig()
        self._gaze = None if gaze_reader is None else StoredGaze(gaze_reader)
        self._posture_known = False
        self.reset()

    def reset(self) -> None:
        """Reset to the state before the first image."""
        config = self._config
        self._faces = FaceTracker(self._finder, config.faces)
        self._objects = SalientObjects(
            config.interest, config.features, config.motion, config.grouping, config.tracking
        )

    def detect(
        self,
        image: NDArray[np.uint8],
        stamp_ns: int,
        camera: CameraModel,
        posture: Posture | None,
        depth: RangeSensor | None = None,
    ) -> Percept:
        """Detect faces and salient objects in an (H, W, 3) uint8 RGB image.

        ``posture`` is the head's at the image's stamp. Without one (None) the camera is taken to
        stand still in the base frame, and no face counts as attended: whether the head is still is
        then not known. ``depth`` measured the scene at the same time: the detections then have a
        range where it is known. Raises ValueError where it does not fit the image.
        """
        if self._posture_known != (posture is not None):
            # Directions stored without a posture are not valid with one.
            self._posture_known = posture is not None
            self.reset()
        position = np.zeros(2) if posture is None else posture.position
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        faces = self._faces.update(image, grey, camera, position, stamp_ns)
        rays = [face.ray(position) for face in faces]
        boxes = [face.box(camera, position) for face in faces]
        objects = self._objects.find_objects(
            image, stamp_ns, camera, posture, [_whole_head(box) for box in boxes]
        )
        people = self._faces.people
        attended = people.caregiver_in_view and self._attends(faces[0], rays[0], posture)
        crop_box = self._crop_box(boxes[0]) if attended else None
        face_image = None if crop_box is None else crop_face(grey, crop_box)
        reading = None
        if attended and self._gaze is not None:
            reading = self._gaze.read(image, grey, boxes[0], camera)
        face_rows: list[Detection] = []
        for face, box, ray in zip(faces, boxes, rays, strict=True):
            x, y = ray.tolist()
            picture_follows = attended and not face_rows
            row = Detection(
                Kind.FACE, x, y, *box, face.score, face.track_id, attended=picture_follows,
                gaze_read=picture_follows and reading is not None,
            )  # fmt: skip
            face_rows.append(row)
        other_faces = [] if people.caregiver_in_view else face_rows
        if other_faces:
            # The first face of a message is the caregiver's, for all that follow her.
            face_rows, boxes = [], []
        detections = face_rows + objects
        if depth is not None:
            own = zip(objects, self._objects.masks(), strict=True)
            regions = [
                *(face_region(box) for box in boxes),
                *(ImageRegion(Box(d.u, d.v, d.width, d.height), mask) for d, mask in own),
            ]
            detections = add_ranges(detections, depth.depths(image, regions, camera))
        return Percept(
            detections,
            face_image,
            crop_box,
            self._objects.motion_judged,
            self._objects.moving_share,
            reading,
            people,
            other_faces,
        )

    def _attends(self, face: FaceTrack, ray: NDArray[np.float64], posture: Posture | None) -> bool:
        """Return whether the head rests with a face, at the ray (x, y), in the centre (Eq. 3).

        Where a face was but is no longer found, there is none to attend to.
        """
        if posture is None or not posture.is_still(self._config.attention.still_below_rad_s):
            return False
        if face.missed_s > self._config.attention.attended_within_s:
            return False
        return stands_in_centre(ray, self._config.attention.d_th_rad)

    def _crop_box(self, face: Box) -> Box:
        width = self._config.attention.crop_widths * face.width
        return Box(face.u, face.v, width, width * FACE_ROWS / FACE_COLUMNS)


def _whole_head(face: Box) -> Box:
    """Return the box of the head, with hair, ears and neck, around the box of a face."""
    return Box(face.u, face.v, 1.5 * face.width, 1.8 * face.height)
