"""Images of every camera encoding, as bytes on the wire, against known pictures."""

import cv2
import numpy as np
import pytest
from builtin_interfaces.msg import Time
from sensor_msgs.msg import CompressedImage, Image

from ja_common.core.image_encodings import ImageError
from ja_common.core.sample_depth import SampleDepth
from ja_common.image_codec import decode_compressed, decode_image, encode_image

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


RED_YUV = (81, 90, 240)


def planes(encoding, width, height, pad):
    """Return a red picture in a planar encoding, each row with ``pad`` bytes behind it."""
    y, u, v = RED_YUV
    across = 1 if encoding in ('nv24', 'nv42') else 2
    down = 2 if encoding in ('nv12', 'nv21', 'i420', 'yuv420', 'yv12') else 1
    if encoding in ('nv21', 'nv61', 'nv42', 'yv12'):
        u, v = v, u
    columns, rows, step = width // across, height // down, width + pad

    def padded(row, step):
        return [*row, *[99] * (step - len(row))]

    luma = padded([y] * width, step) * height
    if encoding.startswith('nv'):
        return luma + padded([u, v] * columns, 2 * step // across) * rows
    first, second = (padded([c] * columns, step // across) * rows for c in (u, v))
    return luma + first + second


@pytest.mark.parametrize('pad', [0, 6])
@pytest.mark.parametrize(
    'encoding',
    ['nv12', 'nv21', 'NV12', 'nv16', 'nv61', 'nv24', 'nv42', 'i420', 'yuv420', 'yv12', 'yuv422p'],
)
def test_planar_yuv_gives_the_colour_that_was_packed(encoding, pad):
    data = np.uint8(planes(encoding.lower(), 8, 6, pad))
    decoded = decode_image(message(data, encoding, 8, 6, 8 + pad))
    assert decoded.shape == (6, 8, 3)
    assert np.abs(decoded.astype(int) - (255, 0, 0)).max() <= 4


def test_planar_yuv_puts_each_colour_in_its_place():
    y, u, v = RED_YUV
    luma = np.full((4, 8), y, np.uint8)
    both = np.full((2, 8), 128, np.uint8)
    both[:, :2] = (u, v)  # the two columns at the left are red, the others grey
    decoded = decode_image(message(np.vstack([luma, both]), 'nv12', 8, 4, 8)).astype(int)
    assert (decoded[:, :2, 0] - decoded[:, :2, 1] > 200).all()
    assert (np.ptp(decoded[:, 2:], axis=2) <= 2).all()


@pytest.mark.parametrize('encoding', ['mono16', '16UC1', 'bayer_rggb16', 'rgb16'])
@pytest.mark.parametrize('bits', [10, 12, 14, 16])
def test_samples_of_fewer_bits_are_as_bright_as_those_of_16(encoding, bits):
    samples = 3 if encoding == 'rgb16' else 1
    grey = np.tile(np.linspace(0, 255, 8).astype(np.uint16), (6, 1)).repeat(samples, axis=1)
    wide = grey << (bits - 8)
    decoded = decode_image(message(wide, encoding, 8, 6, 16 * samples), SampleDepth())
    if encoding != 'bayer_rggb16':
        assert np.array_equal(decoded[..., 0], grey[:, ::samples])
    assert decoded.max() > 200


def test_the_depth_found_only_grows_so_that_pictures_do_not_flicker():
    depth = SampleDepth()

    def brightness(value):
        data = np.full((6, 8), value, np.uint16)
        return int(decode_image(message(data, 'mono16', 8, 6, 16), depth)[0, 0, 0])

    assert brightness(0) == 0
    assert brightness(1023) == 255
    assert brightness(4000) == 250
    assert brightness(1023) == 63  # 12 bits from now on
    assert depth.bits == 12


def test_a_stated_depth_holds_and_what_exceeds_it_is_white():
    data = np.uint16([[100, 1023, 4000, 512]])
    decoded = decode_image(message(data, 'mono16', 4, 1, 8), SampleDepth(10))
    assert decoded[0, :, 0].tolist() == [25, 255, 255, 128]


@pytest.mark.parametrize('encoding', ['mono12', 'bayer_rggb12'])
def test_an_encoding_that_states_its_depth(encoding):
    data = np.full((4, 6), 2048, np.uint16)
    assert (decode_image(message(data, encoding, 6, 4, 12)) == 128).all()


@pytest.mark.parametrize('encoding', ['rgba16', 'bgra16', '16UC4'])
def test_sixteen_bit_alpha_is_dropped(encoding):
    samples = RGB if encoding == 'rgba16' else RGB[..., ::-1]
    wide = np.dstack([samples, GREY]).astype(np.uint16) << 8
    assert np.array_equal(decode_image(message(wide, encoding, 7, 5, 56)), RGB)


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
        (message(np.zeros(60), 'nv12', 6, 5, 6), 'even width and height, not 6x5'),
        (message(np.zeros(60, np.uint8), 'nv16', 5, 6, 5), 'even width, not 5x6'),
        (message(np.zeros(35, np.uint8), 'nv21', 6, 4, 6), '35 bytes of data'),
        (message(np.zeros(36, np.uint8), 'nv12', 6, 4, 5), 'step is 5'),
        (message(np.zeros(16 * 12), '32FC1', 4, 12, 16), 'depth or other measurements'),
        (message(np.zeros(16 * 12), '64FC3', 4, 12, 16), 'depth or other measurements'),
        (message(np.zeros(16 * 12), '16SC1', 4, 12, 16), 'depth or other measurements'),
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


@pytest.mark.parametrize(
    'text', ['jpeg', 'JPEG', 'rgb8; jpeg compressed bgr8', 'bgr8; jpeg compressed bgr8', '']
)
def test_the_formats_of_image_transport(text):
    flat = np.full((16, 16, 3), (20, 130, 220), np.uint8)
    jpeg = cv2.imencode('.jpg', flat[..., ::-1])[1].tobytes()
    decoded = decode_compressed(CompressedImage(format=text, data=jpeg))
    assert np.abs(decoded.astype(int) - flat).max() <= 3


def test_a_sender_that_compressed_rgb_as_if_it_were_bgr():
    png = cv2.imencode('.png', RGB)[1].tobytes()
    text = 'rgb8; png compressed rgb8'
    assert np.array_equal(decode_compressed(CompressedImage(format=text, data=png)), RGB)


def test_a_compressed_mosaic_becomes_colour():
    mosaic = np.tile(np.uint8([[200, 120], [120, 40]]), (4, 5))
    png = cv2.imencode('.png', mosaic)[1].tobytes()
    decoded = decode_compressed(CompressedImage(format='bayer_rggb8; png compressed ', data=png))
    assert decoded[4, 4].tolist() == [200, 120, 40]


def test_a_compressed_picture_of_12_bits_is_as_bright_as_one_of_8():
    png = cv2.imencode('.png', GREY.astype(np.uint16) << 4)[1].tobytes()
    msg = CompressedImage(format='mono16; png compressed mono16', data=png)
    assert np.array_equal(decode_compressed(msg, SampleDepth())[..., 0], GREY)


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('16UC1; compressedDepth png', 'holds distances'),
        ('32FC1; compressedDepth', 'holds distances'),
        ('h264', 'a stream of video'),
        ('bgr8; hevc', 'a stream of video'),
    ],
)
def test_what_is_no_picture_is_named(text, reason):
    with pytest.raises(ImageError, match=reason):
        decode_compressed(CompressedImage(format=text, data=bytes(100)))


@pytest.mark.parametrize('extension', ['.jpg', '.png'])
def test_a_picture_that_ends_early_is_refused(extension):
    noise = np.random.default_rng(0).integers(0, 255, (60, 80, 3), np.uint8)
    whole = cv2.imencode(extension, noise)[1].tobytes()
    decode_compressed(CompressedImage(data=whole + bytes(64)))  # padding of a driver
    with pytest.raises(ImageError, match='ends early'):
        decode_compressed(CompressedImage(data=whole[: len(whole) // 2]))
