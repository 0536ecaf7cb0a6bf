"""Make docs/images/demo.png: what the robot sees, beside the success curve of a demo.

.venv/bin/python tools/make_demo_picture.py runs/<time>-demo/success_curve.png
"""

import sys
from pathlib import Path

import cv2
import numpy as np

from ja_common.core.annotate import annotated
from ja_common.core.camera_model import CameraModel
from ja_common.core.fixation import WIDTH_SIXTH
from ja_common.core.posture import Posture
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import SalientFeatureDetector
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld

OUTPUT = Path(__file__).parents[1] / 'docs' / 'images' / 'demo.png'


def picture_of_a_look() -> np.ndarray:
    """Return a BGR picture, 640 x 480, in which the face shows where she looks."""
    world = JointAttentionWorld(load_scene('easy'), seed=4, image_size=(640, 480))
    detector = SalientFeatureDetector(BlazeFace())
    lens = world.intrinsics
    camera = CameraModel(lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy)
    for _ in range(12):
        world.step(0.1)
        seen, joints = world.observe(), world.joint_state()
        posture = Posture(seen.stamp_ns, joints.position, joints.velocity)
        percept = detector.detect(seen.image, seen.stamp_ns, camera, posture)
    world.close()
    picture = annotated(seen.image, percept, camera, WIDTH_SIXTH, latency_s=0.0)
    return cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)


def main() -> None:
    """Join both pictures at equal height."""
    curve = cv2.imread(sys.argv[1])
    if curve is None:
        sys.exit(f'{sys.argv[1]} is no readable picture')
    look = picture_of_a_look()
    width = round(curve.shape[1] * look.shape[0] / curve.shape[0])
    joined = np.hstack([look, cv2.resize(curve, (width, look.shape[0]), None, 0, 0, 3)])
    cv2.imwrite(str(OUTPUT), joined, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(OUTPUT)


if __name__ == '__main__':
    main()
