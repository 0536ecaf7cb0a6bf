"""Images and calibration of a camera as it is mounted become upright ones."""

import cv2
import numpy as np
import pytest
from builtin_interfaces.msg import Time
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Header

from ja_common.camera_info_codec import encode_camera_info
from ja_common.camera_input import CameraInput, CameraInputConfig
from ja_common.core.config import ConfigError
from ja_common.image_codec import encode_image

UPRIGHT = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)


def as_delivered(upright, degrees):
    """Return the picture that a camera delivers which must be turned clockwise by so much."""
    return np.ascontiguousarray(np.rot90(upright, degrees // 90))


def camera_input(topic='/image_raw', **parameters):
    return CameraInput(CameraInputConfig(**parameters), topic)


@pytest.mark.parametrize('degrees', [0, 90, 180, 270])
def test_the_picture_is_upright_and_the_camera_fits_it(degrees):
    delivered = as_delivered(UPRIGHT, degrees)
    camera_in = camera_input(image_rotation_deg=degrees)
    height, width = delivered.shape[:2]
    camera_in.record_camera_info(encode_camera_info(Header(), width, height, 50.0, 60.0))
    picture = camera_in.decode(encode_image(delivered, Time(), 'eye'))
    assert np.array_equal(picture, UPRIGHT)
    camera = camera_in.camera(picture)
    assert (camera.width, camera.height) == (64, 48)
    assert (camera.fx, camera.fy) == ((50.0, 60.0) if degrees % 180 == 0 else (60.0, 50.0))
    assert np.array_equal(camera_in.as_mounted(picture), delivered)


def test_compressed_images_are_turned_as_well():
    delivered = as_delivered(UPRIGHT, 180)
    png = cv2.imencode('.png', delivered[..., ::-1])[1].tobytes()
    camera_in = camera_input(image_rotation_deg=180)
    assert np.array_equal(camera_in.decode(CompressedImage(format='png', data=png)), UPRIGHT)


def test_what_is_measured_in_a_turned_picture_has_its_own_frame():
    header = Header(stamp=Time(sec=3), frame_id='eye')
    assert camera_input().upright_header(header) == header
    turned = camera_input(image_rotation_deg=90).upright_header(header)
    assert (turned.stamp, turned.frame_id) == (header.stamp, 'eye_upright')


@pytest.mark.parametrize(
    ('topic', 'geometry', 'rectified'),
    [
        ('/camera/image_rect', 'auto', True),
        ('/left/image_rect_color/compressed', 'auto', True),
        ('/camera/image_raw', 'auto', False),
        ('/camera/rectangle', 'auto', False),
        ('/image_rect', 'raw', False),
        ('/image_raw', 'rectified', True),
    ],
)
def test_rectified_images_are_those_of_image_rect(topic, geometry, rectified):
    camera_in = camera_input(topic, image_geometry=geometry)
    info = encode_camera_info(Header(), 64, 48, 50.0)
    info.d[0] = -0.3
    info.p[0] = 44.0
    camera_in.record_camera_info(info)
    camera = camera_in.camera(UPRIGHT)
    assert (camera.fx, camera.lens is None) == ((44.0, True) if rectified else (50.0, False))


def test_the_last_good_calibration_stays():
    camera_in = camera_input()
    assert not camera_in.has_calibration
    assert camera_in.camera(UPRIGHT) is None
    info = encode_camera_info(Header(), 64, 48, 50.0)
    camera_in.record_camera_info(info)
    info.distortion_model = 'omnidirectional'
    with pytest.raises(ValueError, match="'omnidirectional' is not known"):
        camera_in.record_camera_info(info)
    assert camera_in.camera(UPRIGHT).fx == 50.0


@pytest.mark.parametrize(
    'wrong', [dict(image_rotation_deg=45), dict(image_rotation_deg=360), dict(significant_bits=4)]
)
def test_other_values_are_refused(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        CameraInputConfig(**wrong)
