"""A digital head before a film of two people: the other one is never taken for the caregiver."""

from dataclasses import replace

import cv2
import numpy as np

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Kind
from ja_common.core.geometry import directions_of_rays
from ja_perception.core.detector import SalientFeatureDetector
from ja_perception.core.face_finders import BlazeFace
from ja_sim.core.digital_head import DigitalHead, DigitalHeadConfig
from people_in_pictures import DrawnPerson, picture_of

PERIOD_S = 0.1
HERS = DrawnPerson(220.0, v=180.0, width=110.0, clothes=(60, 70, 110), hair=(60, 40, 30))
OTHER = DrawnPerson(
    450.0, v=180.0, width=110.0, clothes=(190, 180, 160), hair=(150, 140, 130), beard=True
)
# An empty room, the caregiver on the left, both, and the other one alone on the right.
PARTS = [((), 25), ((HERS,), 50), ((HERS, OTHER), 30), ((OTHER,), 35)]
AT_HER, ASIDE = (0.16, 0.0), (-0.15, 0.05)


def test_the_head_keeps_to_the_caregiver_while_people_come_and_go():
    detector, head = SalientFeatureDetector(BlazeFace()), DigitalHead()
    config = DigitalHeadConfig()
    camera = CameraModel.from_field_of_view(
        config.view_width_px, config.view_height_px, config.view_rad
    )
    rng, count, statements, others = np.random.default_rng(0), 0, set(), 0
    for people, images in 2 * PARTS:
        for number in range(images):
            count += 1
            turned = [replace(each, look=float(np.sin(0.5 * number))) for each in people]
            wide = picture_of(*turned, width=640, height=480)
            wide = cv2.add(wide, rng.integers(0, 10, wide.shape, np.uint8))
            head.command(AT_HER if (PERIOD_S * count) % 3.0 < 1.5 else ASIDE)
            stamp_ns = round(1e9 * PERIOD_S * count)
            view, posture = head.render_view(wide, stamp_ns)
            found = detector.detect(view, stamp_ns, camera, posture)
            statements.add(found.people.describe().partition(', for')[0])
            others += found.people.others
            for each in found.detections:
                if each.kind is Kind.FACE:
                    pan, _ = directions_of_rays(posture.position, each.ray)
                    # Between the two, from the middle of the wide picture.
                    assert pan > 0.0, f'the face of another at image {count}'
                    break
            assert found.people.caregivers <= 1, f'another caregiver at image {count}'
    assert {'I see no person', 'I see the caregiver'} <= statements
    assert others > 0, 'the other one was seen, too'
