"""A picture is not decoded when it claims more pixels than any camera has."""

import struct

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage

from ja_common.core.image_encodings import ImageError
from ja_common.core.picture_size import picture_size
from ja_common.image_codec import decode_compressed


def encoded(extension: str, *options: int) -> bytes:
    picture = np.zeros((30, 50, 3), np.uint8)
    return cv2.imencode(extension, picture, options)[1].tobytes()


PROGRESSIVE = (cv2.IMWRITE_JPEG_PROGRESSIVE, 1)


@pytest.mark.parametrize(
    ('extension', 'options'), [('.png', ()), ('.jpg', ()), ('.jpg', PROGRESSIVE)]
)
def test_the_size_is_read_as_the_decoder_reads_it(extension, options):
    data = encoded(extension, *options)
    assert picture_size(data) == (50, 30)
    assert decode_compressed(CompressedImage(data=data)).shape == (30, 50, 3)


def claiming(extension: str) -> bytes:
    """Return a small picture that claims 60000 x 60000 pixels."""
    data = bytearray(encoded(extension))
    if extension == '.png':
        data[16:24] = struct.pack('>II', 60000, 60000)
    else:
        place = data.index(b'\xff\xc0') + 5
        data[place : place + 4] = struct.pack('>HH', 60000, 60000)
    return bytes(data)


@pytest.mark.parametrize('extension', ['.png', '.jpg'])
def test_a_claim_of_billions_of_pixels_is_refused(extension):
    with pytest.raises(ImageError, match='60000x60000 is larger'):
        decode_compressed(CompressedImage(data=claiming(extension)))


@pytest.mark.parametrize('extension', ['.bmp', '.tiff', '.webp'])
def test_a_format_that_the_message_does_not_allow_is_not_decoded(extension):
    with pytest.raises(ImageError, match='no readable picture'):
        decode_compressed(CompressedImage(data=encoded(extension)))


def test_no_cut_or_damaged_picture_breaks_the_reading():
    rng = np.random.default_rng(0)
    for extension in ('.png', '.jpg'):
        whole = encoded(extension)
        for length in range(0, len(whole), 5):
            damaged = bytearray(whole[:length])
            if damaged:
                damaged[rng.integers(len(damaged))] ^= 0xFF
            size = picture_size(bytes(damaged))
            assert size is None or len(size) == 2
