"""CameraInfo as a camera model."""

import pytest
from sensor_msgs.msg import CameraInfo, RegionOfInterest
from std_msgs.msg import Header

from ja_common.camera_info_codec import (
    decode_calibration,
    decode_camera_info,
    encode_camera_info,
)


def test_a_calibration_is_scaled_to_the_size_of_the_image():
    camera = decode_camera_info(encode_camera_info(Header(), 640, 480, 500.0), 320, 240)
    assert (camera.width, camera.height, camera.fx, camera.cx) == (320, 240, 250.0, 159.5)


def test_a_calibration_without_a_size_is_that_of_the_image():
    info = encode_camera_info(Header(), 320, 240, 250.0)
    info.width = info.height = 0
    assert decode_camera_info(info, 320, 240).fx == 250.0


@pytest.mark.parametrize('info', [None, CameraInfo()])
def test_without_a_calibration_there_is_no_camera(info):
    assert decode_camera_info(info, 320, 240) is None


def test_all_fields_that_change_the_geometry_are_decoded():
    info = encode_camera_info(Header(), 640, 480, 500.0)
    info.distortion_model, info.d = 'equidistant', [0.1, 0.2, 0.3, 0.4]
    info.binning_x, info.binning_y = 2, 4
    info.roi = RegionOfInterest(x_offset=1, y_offset=2, width=3, height=4)
    calibration = decode_calibration(info)
    assert calibration.model == 'equidistant'
    assert calibration.d == (0.1, 0.2, 0.3, 0.4)
    assert calibration.size == (640, 480)
    assert calibration.binning == (2, 4)
    assert calibration.roi == (1, 2, 3, 4)
    assert (calibration.k[0], calibration.p[5]) == (500.0, 500.0)
