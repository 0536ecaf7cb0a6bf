"""Depth images of REP-118 as drivers send them."""

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from sensor_msgs.msg import Image

from ja_common.core.image_encodings import ImageError
from ja_common.depth_decoder import decode_depth
from ja_common.depth_encoder import DEPTH_ENCODINGS, encode_depth

DEPTH = np.array([[0.5, 1.25, np.nan], [2.0, 3.001, 4.0]], np.float32)


def metres(message):
    samples, unit_m = decode_depth(message)
    found = samples.astype(np.float32) * np.float32(unit_m)
    return np.where(found == 0, np.nan, found)


@pytest.mark.parametrize('encoding', DEPTH_ENCODINGS)
def test_what_the_encoder_writes_is_read(encoding):
    np.testing.assert_allclose(metres(encode_depth(DEPTH, encoding, Time(), 'eye')), DEPTH)


@pytest.mark.parametrize(
    ('encoding', 'kind', 'scale'),
    [('16UC1', '>u2', 1000), ('32FC1', '>f4', 1), ('mono16', '<u2', 1000), ('32fc1', '<f4', 1)],
)
def test_either_byte_order_with_padded_rows(encoding, kind, scale):
    samples = (scale * np.nan_to_num(DEPTH)).round(3).astype(kind)
    rows = samples.view(np.uint8).reshape(2, -1)
    step = rows.shape[1] + 5
    padded = np.full((2, step), 0xAB, np.uint8)
    padded[:, : rows.shape[1]] = rows
    data = padded.tobytes()[:-5]  # the last row without its padding, as some drivers send it
    message = Image(
        width=3, height=2, encoding=encoding, step=step, is_bigendian=int('>' in kind), data=data
    )
    np.testing.assert_allclose(metres(message), DEPTH)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        (dict(encoding='rgb8'), "'rgb8' is no depth: it must be 16UC1"),
        (dict(encoding='64FC1'), 'is no depth'),
        (dict(encoding=''), 'is no depth'),
        (dict(step=3), 'step is 3, but a row of 3 depths takes 6 bytes'),
        (dict(data=b'short'), '5 bytes of data'),
        (dict(width=0), 'no pixels'),
        (dict(height=0), 'no pixels'),
    ],
)
def test_nonsense_is_refused_in_one_sentence(changes, reason):
    fields = dict(width=3, height=2, encoding='16UC1', step=6, data=bytes(12)) | changes
    with pytest.raises(ImageError, match=reason):
        decode_depth(Image(**fields))
