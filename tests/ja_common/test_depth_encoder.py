"""Depth pictures on the wire: whole millimetres or metres, holes as REP-118 has them."""

import numpy as np
import pytest
from builtin_interfaces.msg import Time

from ja_common.depth_encoder import encode_depth

DEPTH = np.array([[0.5, 1.2344, np.nan], [70.0, np.inf, 65.535]], np.float32)


def test_whole_millimetres_and_zero_where_nothing_was_measured() -> None:
    message = encode_depth(DEPTH, '16UC1', Time(sec=3), 'camera')
    assert (message.height, message.width, message.step) == (2, 3, 6)
    assert (message.header.stamp.sec, message.header.frame_id) == (3, 'camera')
    samples = np.frombuffer(message.data, '<u2').reshape(2, 3)
    np.testing.assert_array_equal(samples, [[500, 1234, 0], [0, 0, 65535]])


def test_metres_and_nan_where_nothing_was_measured() -> None:
    message = encode_depth(DEPTH[:, ::2], '32FC1', Time(), '')
    assert (message.height, message.width, message.step) == (2, 2, 8)
    samples = np.frombuffer(message.data, '<f4').reshape(2, 2)
    np.testing.assert_array_equal(samples, DEPTH[:, ::2])


@pytest.mark.parametrize(
    ('depth', 'encoding', 'part'),
    [(DEPTH, 'mono16', '16UC1 or 32FC1'), (DEPTH[0], '16UC1', r'is \(H, W\), not \(3,\)')],
)
def test_anything_else_is_refused(depth: np.ndarray, encoding: str, part: str) -> None:
    with pytest.raises(ValueError, match=part):
        encode_depth(depth, encoding, Time(), '')
