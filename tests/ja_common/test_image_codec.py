"""Images of every camera encoding, as bytes on the wire, against known pictures."""

import cv2
import numpy as np
import pytest
from builtin_interfaces.msg import Time
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header

from ja_common.image_codec import (
    ImageError,
    decode_camera_info,
    decode_compressed,
    decode_image,
    encode_camera_info,
    encode_image,
)

RGB = np.random.default_rng(1).integers(0, 256, (5, 7, 3), np.uint8)
GREY = RGB[..., 0]


def message(data, encoding, width, height, step, big_endian=False):
    return Image(
        width=width, height=height, encoding=encoding, step=step,
        is_bigendian=big_endian, data=np.asarray(data).tobytes(),
    )  # fmt: skip


@pytest.mark.parametrize(
    ('encoding', 'samples', 'expected'),
    [
        ('rgb8', RGB, RGB),
        ('bgr8', RGB[..., ::-1], RGB),
        ('rgba8', np.dstack([RGB, GREY]), RGB),
        ('bgra8', np.dstack([RGB[..., ::-1], GREY]), RGB),
        ('mono8', GREY, np.dstack([GREY] * 3)),
    ],
)
def test_eight_bit_encodings_survive_row_padding_and_odd_sizes(encoding, samples, expected):
    rows = np.ascontiguousarray(samples).reshape(5, -1)
    padded = np.hstack([rows, np.full((5, 3), 99, np.uint8)])
    decoded = decode_image(message(padded, encoding, 7, 5, padded.shape[1]))
    assert np.array_equal(decoded, expected)


@pytest.mark.parametrize('big_endian', [False, True])
def test_sixteen_bit_samples_keep_their_high_byte(big_endian):
    wide = (GREY.astype(np.uint16) << 8) + 17
    data = wide.astype('>u2' if big_endian else '<u2')
    decoded = decode_image(message(data, 'mono16', 7, 5, 14, big_endian))
    assert np.array_equal(decoded[..., 1], GREY)


@pytest.mark.parametrize('encoding', ['yuv422', 'uyvy', 'yuv422_yuy2', 'yuyv'])
def test_yuv_422_gives_the_colour_that_was_packed(encoding):
    red_in_yuv = (81, 90, 240)  # ITU-R BT.601, studio range
    y, u, v = red_in_yuv
    pair = (u, y, v, y) if encoding in ('yuv422', 'uyvy') else (y, u, y, v)
    decoded = decode_image(message(np.tile(np.uint8(pair), 4 * 3), encoding, 8, 3, 16))
    assert decoded.shape == (3, 8, 3)
    assert np.abs(decoded.astype(int) - (255, 0, 0)).max() <= 4


@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
@pytest.mark.parametrize('bits', [8, 16])
def test_bayer_mosaic_of_one_colour_gives_that_colour(pattern, bits):
    colour = dict(r=200, g=120, b=40)
    cell = np.array([colour[letter] for letter in pattern]).reshape(2, 2)
    mosaic = np.tile(cell, (4, 5)).astype(np.uint16 if bits == 16 else np.uint8)
    if bits == 16:
        mosaic <<= 8
    decoded = decode_image(message(mosaic, f'bayer_{pattern}{bits}', 10, 8, mosaic.strides[0]))
    assert np.array_equal(decoded[2:-2, 2:-2], np.broadcast_to((200, 120, 40), (4, 6, 3)))


def test_last_row_may_lack_its_padding():
    padded = np.hstack([RGB.reshape(5, -1), np.zeros((5, 3), np.uint8)]).ravel()[:-3]
    assert np.array_equal(decode_image(message(padded, 'rgb8', 7, 5, 24)), RGB)


@pytest.mark.parametrize(
    ('broken', 'reason'),
    [
        (message(RGB, 'yuv999', 7, 5, 21), "encoding 'yuv999' is not supported"),
        (message(b'', 'rgb8', 0, 0, 0), 'no pixels'),
        (message(RGB, 'rgb8', 7, 5, 20), 'step is 20'),
        (message(RGB[:4], 'rgb8', 7, 5, 21), '84 bytes of data'),
        (message(RGB, 'yuyv', 7, 5, 21), 'even width'),
    ],
)
def test_a_broken_image_is_refused_with_its_reason(broken, reason):
    with pytest.raises(ImageError, match=reason):
        decode_image(broken)


def test_what_is_encoded_is_decoded_again():
    stamp = Time(sec=3, nanosec=4)
    for pixels in (RGB, GREY):
        msg = encode_image(pixels, stamp, 'camera')
        assert (msg.header.stamp, msg.header.frame_id) == (stamp, 'camera')
        decoded = decode_image(msg)
        assert np.array_equal(decoded if pixels.ndim == 3 else decoded[..., 0], pixels)


def test_only_8_bit_pictures_are_encoded():
    with pytest.raises(ImageError, match='float64'):
        encode_image(np.zeros((4, 4)), Time(), 'camera')


def test_png_and_jpeg():
    png = cv2.imencode('.png', RGB[..., ::-1])[1]
    assert np.array_equal(decode_compressed(CompressedImage(data=png.tobytes())), RGB)
    flat = np.full((16, 16, 3), (20, 130, 220), np.uint8)
    jpeg = cv2.imencode('.jpg', flat[..., ::-1])[1]
    decoded = decode_compressed(CompressedImage(format='jpeg', data=jpeg.tobytes()))
    assert np.abs(decoded.astype(int) - flat).max() <= 3


@pytest.mark.parametrize('data', [b'', b'no picture'])
def test_broken_compressed_data_is_refused(data):
    with pytest.raises(ImageError, match='no readable picture'):
        decode_compressed(CompressedImage(format='jpeg', data=data))


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
