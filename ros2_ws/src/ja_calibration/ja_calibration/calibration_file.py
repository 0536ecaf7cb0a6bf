"""What was found, as a table for people and as a YAML file."""

from pathlib import Path
from typing import Any

import yaml

from ja_calibration.core.course import Calibration
from ja_calibration.core.figure import Figure

SUREST_DELAY_ERROR_S = 0.005
"""A delay with a larger standard error is not written: it would be off by 10 ms now and then."""


def as_dict(
    found: Calibration, inverted: tuple[bool, bool], image_size: tuple[int, int]
) -> dict[str, Any]:
    """The file's contents; `inverted` is what `pan_inverted`, `tilt_inverted` were meanwhile."""
    optics, lag = found.optics, found.lag
    pan, tilt = (was != (sign < 0) for was, sign in zip(inverted, optics.signs, strict=True))
    contents: dict[str, Any] = {
        'image_width': image_size[0],
        'image_height': image_size[1],
        'focal_length_x_px': _pair(optics.focal_x),
        'focal_length_y_px': _pair(optics.focal_y),
        'pan_inverted': pan,
        'tilt_inverted': tilt,
        'pan_gain': _pair(found.pan_gain),
        'tilt_gain': _pair(found.tilt_gain),
        'pan_backlash_rad': _pair(lag.backlash),
        'tilt_backlash_rad': _pair(optics.tilt_backlash),
    }
    if lag.delay_s.error <= SUREST_DELAY_ERROR_S:
        contents['camera_delay_s'] = _pair(lag.delay_s)
    return contents


def save(contents: dict[str, Any], path: Path) -> None:
    """Write the file, whole or not at all. Raises OSError."""
    text = '# Found by ./ja calibrate. Errors are standard errors; docs/deploy.md says of what.\n'
    partial = path.with_name(f'{path.name}.partial')
    partial.write_text(text + yaml.safe_dump(contents, sort_keys=False))
    partial.replace(path)


def _pair(figure: Figure) -> dict[str, float]:
    return {'value': float(f'{figure.value:.5g}'), 'error': float(f'{figure.error:.2g}')}
