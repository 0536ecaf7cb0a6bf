"""The whole detector on drawn pictures."""

from dataclasses import replace

import numpy as np
import pytest

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Kind
from ja_common.core.geometry import directions_of_rays, rays_of_directions
from ja_common.core.posture import Posture
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import DetectorConfig, SalientFeatureDetector
from ja_perception.core.salient_objects import InterestConfig
from ja_sim.core.digital_head import DigitalHead, DigitalHeadConfig
from synthetic_pictures import draw_ball, draw_face, room

FIELD_OF_VIEW = np.radians(36)
CAMERA = CameraModel.from_field_of_view(320, 240, FIELD_OF_VIEW)
STEP_NS = 100_000_000
RED, GREEN = (220, 30, 30), (30, 200, 40)


@pytest.fixture(scope='module')
def finder():
    return BlazeFace()


def interest(*alphas):
    return DetectorConfig(interest=InterestConfig(*map(float, alphas)))


def at(position=(0.0, 0.0), velocity=(0.0, 0.0), stamp_ns=STEP_NS):
    return Posture(stamp_ns, np.array(position, float), np.array(velocity, float))


def caregiver_and_ball():
    picture = room()
    draw_face(picture, 160, 110, 80)
    draw_ball(picture, 280, 60, 14)
    return picture


def test_face_first_then_objects_by_saliency(finder):
    picture = caregiver_and_ball()
    draw_ball(picture, 40, 200, 20, GREEN)
    percept = SalientFeatureDetector(finder).detect(picture, STEP_NS, CAMERA, at())
    face, larger, smaller = percept.detections
    assert face.kind is Kind.FACE
    assert (larger.u, larger.v) == pytest.approx((40, 200), abs=1)
    assert (smaller.u, smaller.v) == pytest.approx((280, 60), abs=1)
    assert percept.target is larger
    assert larger.ray == pytest.approx(CAMERA.rays((40, 200)), abs=0.003)


def test_size_of_colour_follows_its_formula(finder):
    percept = SalientFeatureDetector(finder).detect(caregiver_and_ball(), STEP_NS, CAMERA, at())
    gazing_px = np.pi * (CAMERA.width / 6) ** 2  # d_th of the paper: a sixth of the width
    area = np.pi * 14**2
    assert percept.target.f_col == pytest.approx(area / (area + gazing_px), rel=0.1)
    assert percept.target.score == percept.target.f_col


def test_skin_and_clothes_of_a_face_are_no_object(finder):
    picture = room()
    draw_face(picture, 160, 110, 80)
    picture[150:160, 130:190] = RED  # lipstick, or a scarf
    percept = SalientFeatureDetector(finder).detect(picture, STEP_NS, CAMERA, at())
    assert [d.kind for d in percept.detections] == [Kind.FACE]


@pytest.mark.parametrize(
    ('u', 'velocity', 'attended'), [(160, 0.0, True), (160, 0.3, False), (235, 0.0, False)]
)
def test_attended_when_in_the_centre_and_still(finder, u, velocity, attended):
    picture = room()
    draw_face(picture, u, 110, 80)
    percept = SalientFeatureDetector(finder).detect(
        picture, STEP_NS, CAMERA, at(velocity=(velocity, 0.0))
    )
    assert percept.detections[0].attended is attended
    assert (percept.face_image is not None) is attended


def test_without_a_posture_nothing_is_attended_and_memory_starts_anew(finder):
    detector = SalientFeatureDetector(finder)
    first = detector.detect(caregiver_and_ball(), STEP_NS, CAMERA, None)
    assert first.face_image is None
    assert not first.detections[0].attended
    later = detector.detect(caregiver_and_ball(), 2 * STEP_NS, CAMERA, at((0.7, 0.1)))
    assert later.detections[0].attended


def test_face_image_shows_the_look(finder):
    """The crop differs by much more between gazes than between places in the image."""

    def crop(look, u):
        picture = room()
        draw_face(picture, u, 112, 80, look)
        percept = SalientFeatureDetector(finder).detect(picture, STEP_NS, CAMERA, at())
        return percept.face_image.astype(float)

    ahead, elsewhere, left, right = crop(0, 160), crop(0, 168.5), crop(1, 160), crop(-1, 160)
    assert ahead.shape == (30, 25)
    shifted = np.abs(ahead - elsewhere).mean()
    assert np.abs(ahead - left).mean() > 1.5 * shifted
    assert np.abs(left - right).mean() > 2 * shifted


def test_a_panned_scene_does_not_move_but_a_mover_does(finder):
    detector = SalientFeatureDetector(finder, interest(0, 0, 1))
    head = DigitalHead(DigitalHeadConfig(speed_rad_s=100.0, time_constant_s=0.001))
    wall = np.random.default_rng(2).integers(90, 160, (60, 80), np.uint8)
    wall = np.kron(wall, np.ones((8, 8), np.uint8))
    head.command((0.12, 0.0))
    head.render_view(np.zeros((480, 640, 3), np.uint8), 0)
    for k in range(1, 11):
        wide = np.dstack([wall] * 3)
        draw_ball(wide, 240 + 14 * k, 240, 16, (255, 255, 255))
        head.command((0.15 - 0.03 * k, 0.0))
        view, posture = head.render_view(wide, k * STEP_NS)
        percept = detector.detect(view, k * STEP_NS, CAMERA, posture)
        assert percept.motion_judged is (k > 2)
        if k > 2:
            ball = (240 + 14 * k - 319.5, 0.5) / np.array(320 / np.tan(np.radians(30)))
            expected = rays_of_directions(posture.position, directions_of_rays((0, 0), ball))
            (mover,) = percept.detections
            assert mover.ray == pytest.approx(expected, abs=0.04)


def test_motion_is_not_judged_while_the_head_is_fast(finder):
    detector = SalientFeatureDetector(finder, interest(0, 0, 1))
    for k in (1, 2, 3):
        percept = detector.detect(room(), k * STEP_NS, CAMERA, at())
    assert percept.motion_judged
    picture = caregiver_and_ball()
    percept = detector.detect(picture, 4 * STEP_NS, CAMERA, at(velocity=(3.0, 0)))
    assert not percept.motion_judged
    assert percept.target is None


@pytest.mark.parametrize('size', [(64, 48), (161, 121), (640, 480), (1920, 1080)])
def test_sizes_from_tiny_to_large_report_original_pixels(finder, size):
    width, height = size
    picture = room(width, height)
    draw_ball(picture, 0.7 * width, 0.4 * height, 0.05 * width)
    camera = CameraModel.from_field_of_view(width, height, FIELD_OF_VIEW)
    percept = SalientFeatureDetector(finder).detect(picture, STEP_NS, camera, at())
    assert percept.target.u == pytest.approx(0.7 * width, abs=max(1, 0.005 * width))
    assert percept.target.v == pytest.approx(0.4 * height, abs=max(1, 0.005 * width))


def test_same_images_same_percepts(finder):
    def run():
        detector = SalientFeatureDetector(finder, interest(1, 1, 1))
        looks = []
        for k in range(6):
            picture = caregiver_and_ball()
            draw_ball(picture, 60 + 5 * k, 180, 12, GREEN)
            looks.append(detector.detect(picture, (k + 1) * STEP_NS, CAMERA, at()).detections)
        return looks

    assert run() == run()


def test_size_of_the_image_may_change_in_between(finder):
    detector = SalientFeatureDetector(finder, interest(1, 1, 1))
    detector.detect(caregiver_and_ball(), STEP_NS, CAMERA, at())
    small = np.ascontiguousarray(caregiver_and_ball()[::2, ::2])
    percept = detector.detect(small, 2 * STEP_NS, CAMERA.resized(160, 120), at())
    assert percept.detections[0].attended
    assert all(d.f_mot == 0 for d in percept.detections)


def test_alpha_decides_what_is_extracted(finder):
    picture = room()
    picture[60:100:4, 60:110] = 20  # a black and white pattern
    draw_ball(picture, 250, 150, 15)
    by_colour = SalientFeatureDetector(finder, interest(1, 0, 0))
    by_texture = SalientFeatureDetector(finder, interest(0, 1, 0))
    by_both = SalientFeatureDetector(finder, interest(1, 1, 0))
    counts = [
        len(d.detect(picture, STEP_NS, CAMERA, at()).detections)
        for d in (by_colour, by_texture, by_both)
    ]
    assert counts == [1, 1, 2]


def test_configuration_is_frozen(finder):
    config = DetectorConfig()
    changed = replace(config, interest=InterestConfig(alpha_edg=0.5))
    assert config.interest.alpha_edg == 0.0
    assert changed.interest.alpha_edg == 0.5
