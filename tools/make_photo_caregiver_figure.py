"""Draw the figure of docs/photo_caregiver.md: a head from a photograph, turned in the scene.

    python tools/make_photo_caregiver_figure.py docs/images/photo_caregiver.png

The photograph is that of an astronaut in scikit-image, taken by NASA and in the public domain.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from ja_benchmarks.package_pictures import package_picture
from ja_caregiver.core.photo_face import PhotoFaceFinder
from ja_caregiver.core.photo_head import photo_head
from ja_sim.core.photo_head_file import write_photo_head
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld

SIZE = (640, 480)
SHOWN = (slice(60, 380), slice(190, 450))
TURNED_DEG = ((-40, 0), (-20, 0), (0, 0), (20, 0), (40, 0), (25, 12), (0, 15), (0, -12))
COLUMNS, TILE = 3, (182, 224)


def tile(picture: np.ndarray, text: str) -> np.ndarray:
    """Return a picture (H, W, 3) at the size of a tile, with a line of text."""
    small = cv2.resize(picture, TILE, interpolation=cv2.INTER_AREA)
    cv2.putText(
        small, text, (6, TILE[1] - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.42, (255, 255, 255), 1,
        cv2.LINE_AA,
    )  # fmt: skip
    return np.asarray(small)


def draw() -> np.ndarray:
    """Return the figure (H, W, 3) RGB: the photograph, and the head turned in the scene."""
    photograph = package_picture('scikit-image', 'astronaut.png')
    tiles = [tile(photograph[10:266, 120:328], 'the photograph')]
    scene = load_scene('default')
    with tempfile.TemporaryDirectory() as folder:
        file = write_photo_head(
            Path(folder) / 'head.npz', photo_head(PhotoFaceFinder().find_face(photograph))
        )
        caregiver = replace(scene.caregiver, photo=str(file))
        world = JointAttentionWorld(replace(scene, caregiver=caregiver), 1, SIZE)
    for yaw, pitch in TURNED_DEG:
        picture = world.render_picture(np.radians([yaw, pitch]))
        tiles.append(tile(picture[SHOWN], f'yaw {yaw}, pitch {pitch} degrees'))
    world.close()
    rows = [np.hstack(tiles[k : k + COLUMNS]) for k in range(0, len(tiles), COLUMNS)]
    return np.vstack(rows)


def main() -> None:
    """Write the figure."""
    parser = argparse.ArgumentParser(description=__doc__.partition('\n')[0])
    parser.add_argument('file', type=Path)
    file = parser.parse_args().file
    cv2.imwrite(
        str(file), cv2.cvtColor(draw(), cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 9]
    )


if __name__ == '__main__':
    main()
