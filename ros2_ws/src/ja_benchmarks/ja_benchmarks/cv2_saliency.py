"""The saliency maps of opencv-contrib on pictures of a folder, run as a separate process.

opencv-contrib and the OpenCV of this project cannot be loaded in one process, so this runs with
opencv-contrib in PYTHONPATH: ``python cv2_saliency.py FOLDER``. It prints, for each method, the
place of the most salient region in each picture and the processor time:
{method: [[u, v, seconds]]}.
"""

import json
import sys
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np


def main() -> None:
    """Find the most salient region in all pictures of the folder, in the order of their names."""
    cv2.setNumThreads(1)
    saliency: Any = getattr(cv2, 'saliency')  # noqa: B009 - opencv-contrib has it, headless not
    methods = {
        'fine grained': saliency.StaticSaliencyFineGrained_create(),
        'spectral residual': saliency.StaticSaliencySpectralResidual_create(),
    }
    pictures = [cv2.imread(str(path)) for path in sorted(Path(sys.argv[1]).iterdir())]
    places: dict[str, list[list[float]]] = {}
    for name, method in methods.items():
        places[name] = []
        for picture in pictures:
            start = time.thread_time()
            _, saliency = method.computeSaliency(picture)
            seconds = time.thread_time() - start
            places[name].append([*_strongest_region(saliency), seconds])
    print(json.dumps(places))


def _strongest_region(saliency: np.ndarray) -> tuple[float, float]:
    """Return the centre [px] of the region with the most saliency above Otsu's threshold."""
    scaled = cv2.normalize(saliency, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
    _, mask = cv2.threshold(scaled, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    count, labels, _, centres = cv2.connectedComponentsWithStats(mask)
    sums = np.bincount(labels.ravel(), scaled.ravel(), count)
    u, v = centres[1 + int(np.argmax(sums[1:]))]
    return float(u), float(v)


if __name__ == '__main__':
    main()
