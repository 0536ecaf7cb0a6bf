"""The picture of a face as the learner sees it: 30 rows x 25 columns, grey."""

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_perception.core.box import Box

FACE_ROWS, FACE_COLUMNS = 30, 25
# Cut at this multiple of the final size and averaged down: neither aliasing nor whole-pixel steps.
_FINER = 4


def crop_face(grey: NDArray[np.uint8], box: Box) -> NDArray[np.uint8]:
    """Return the part of an (H, W) image in ``box``, (30, 25) uint8, with sub-pixel position.

    Beyond the image its border is repeated.
    """
    columns, rows = FACE_COLUMNS * _FINER, FACE_ROWS * _FINER
    step_u, step_v = box.width / columns, box.height / rows
    fine_to_image = np.array(
        [[step_u, 0, box.left + step_u / 2], [0, step_v, box.top + step_v / 2]]
    )
    fine = cv2.warpAffine(
        grey,
        fine_to_image,
        (columns, rows),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return cv2.resize(fine, (FACE_COLUMNS, FACE_ROWS), interpolation=cv2.INTER_AREA)
