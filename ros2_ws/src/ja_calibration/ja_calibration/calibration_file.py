"""The result of a calibration as a YAML file."""

from pathlib import Path
from typing import Any

import yaml

from ja_calibration.core.calibration_moves import Calibration
from ja_calibration.core.fitted_value import FittedValue
from ja_common.core.files import write_file

LARGEST_DELAY_ERROR_S = 0.005
"""A delay with a larger standard error is not written: it could be off by 10 ms."""


def as_dict(
    result: Calibration, inverted: tuple[bool, bool], image_size: tuple[int, int]
) -> dict[str, Any]:
    """Return the contents of the file.

    `inverted`: the values of `pan_inverted` and `tilt_inverted` during the calibration.
    """
    optics, lag = result.optics, result.lag
    pan, tilt = (was != (sign < 0) for was, sign in zip(inverted, optics.signs, strict=True))
    contents: dict[str, Any] = {
        'image_width': image_size[0],
        'image_height': image_size[1],
        'focal_length_x_px': _pair(optics.focal_x),
        'focal_length_y_px': _pair(optics.focal_y),
        'pan_inverted': pan,
        'tilt_inverted': tilt,
        'pan_gain': _pair(result.pan_gain),
        'tilt_gain': _pair(result.tilt_gain),
        'pan_backlash_rad': _pair(lag.backlash),
        'tilt_backlash_rad': _pair(optics.tilt_backlash),
    }
    if lag.delay_s.error <= LARGEST_DELAY_ERROR_S:
        contents['camera_delay_s'] = _pair(lag.delay_s)
    return contents


def save(contents: dict[str, Any], path: Path) -> None:
    """Write the file, whole or not at all. Raises SaveError."""
    text = '# Found by ./ja calibrate. Errors are standard errors; see docs/deploy.md.\n'
    write_file(path, text + yaml.safe_dump(contents, sort_keys=False))


def _pair(fitted: FittedValue) -> dict[str, float]:
    return {'value': float(f'{fitted.value:.5g}'), 'error': float(f'{fitted.error:.2g}')}
