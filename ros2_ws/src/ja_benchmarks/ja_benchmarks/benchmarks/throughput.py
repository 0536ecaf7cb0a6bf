"""The cost of the middleware: the whole graph in lockstep against its parts without ROS.

At 320x240 in the default scene, with the paper's learner. The parts are the cores of the nodes,
called one after the other in one thread. They are measured before and after each graph, because a
machine has other work as well. Rates are of wall time. With `draw_ahead` the sim draws a picture
while the nodes process the last one, so the graph may be faster than its parts one by one. The
cost of the middleware shows best in processor time, which other work disturbs less: that of the
graph in one process, against that of the parts.
"""

import time
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ja_benchmarks.benchmarks.graph import lockstep_rates
from ja_benchmarks.rows import Row, row
from ja_common.core.camera_model import CameraModel
from ja_common.core.posture import Posture
from ja_experiments.agents.robot import Robot
from ja_experiments.config import ExperimentConfig
from ja_learning.core.network import ThreeLayerNetwork
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.detector import SalientFeatureDetector
from ja_runner.graph import CONFIG, preset, sim_graph
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld

SCENE, LEARNER = 'default', 'paper'
SIZE = (320, 240)
IMAGE_PERIOD_S = 0.1
WARM_UP_IMAGES, IMAGES = 50, 500
COMPOSITIONS = {
    'one process': (True, False),
    'many processes': (False, False),
    'one process, drawing ahead': (True, True),
    'many processes, drawing ahead': (False, True),
}
"""Of each graph: is it in one process, and is the next picture drawn ahead?"""
PARTS = ('world', 'detector', 'controller, learner, evaluator and gate')


def run() -> dict[str, Row]:
    """Measure the parts, the graph in one process and in many, and the ratios."""
    parts, graphs = [_parts()], {}
    for name, (one_process, ahead) in COMPOSITIONS.items():
        size = {'image_width': SIZE[0], 'image_height': SIZE[1]}
        sim = {'scene': SCENE, **size, 'draw_ahead': ahead}
        graphs[name] = lockstep_rates(sim_graph(0, sim, LEARNER), one_process)
        parts.append(_parts())
    busy = np.concatenate([1e3 * each[1] for each in parts])
    alone = row(busy.sum(axis=1), 'ms/image')
    composed = graphs['one process']['processor time of this process']
    rows = {f'processor time, {name}': row(busy[:, i], 'ms/image') for i, name in enumerate(PARTS)}
    rows |= {
        'processor time, all parts': alone,
        'processor time, graph in one process': composed,
        'share of the parts, processor time': _ratio(alone, composed),
    }
    for (before, after), (name, graph) in zip(pairwise(parts), graphs.items(), strict=True):
        around = row(np.concatenate([before[0], after[0]]).sum(axis=1), 'images/s', _rate)
        rows |= {
            f'rate, parts around {name}': around,
            f'rate, graph in {name}': graph['image steps'],
            f'trials, graph in {name}': graph['trials'],
            f'share of the parts, {name}': _ratio(graph['image steps'], around),
        }
    return rows


def _parts() -> NDArray[np.float64]:
    """Measure wall and processor time [s] of each part for each image, (2, IMAGES, 3)."""
    dwell_s = preset(CONFIG / 'demo.yaml', 'gate')['dwell_s']
    config = ExperimentConfig().with_settings({'dwell_s': dwell_s})
    robot = Robot(config, ThreeLayerNetwork(config.network, 0), np.random.default_rng(0))
    detector = SalientFeatureDetector(BlazeFace())
    world = JointAttentionWorld(load_scene(SCENE), 0, SIZE)
    lens = world.intrinsics
    camera = CameraModel(lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy)
    times = []
    for _ in range(WARM_UP_IMAGES + IMAGES):
        stamps = [_now_s()]
        world.step(IMAGE_PERIOD_S)
        seen, joints = world.observe(), world.joint_state()
        stamps.append(_now_s())
        posture = Posture(seen.stamp_ns, joints.position, joints.velocity)
        percept = detector.detect(seen.image, seen.stamp_ns, camera, posture)
        stamps.append(_now_s())
        step = robot.step(percept.detections, percept.face_image, posture)
        stamps.append(_now_s())
        world.command(step.command)
        times.append(np.diff(stamps, axis=0))
    world.close()
    return np.array(times[WARM_UP_IMAGES:]).transpose(2, 0, 1)


def _now_s() -> tuple[float, float]:
    return time.perf_counter(), time.process_time()


def _rate(seconds: NDArray[np.float64], axis: int = -1) -> Any:
    return 1.0 / np.mean(seconds, axis=axis)


def _ratio(one: Row, other: Row) -> Row:
    """Return the ratio of two figures; their relative errors add in quadrature."""
    value = one['value'] / other['value']
    half = value * np.hypot(_relative_half(one), _relative_half(other))
    return {
        'value': value, 'unit': 'share', 'n': min(one['n'], other['n']),
        'interval': [float(value - half), float(value + half)],
    }  # fmt: skip


def _relative_half(row: Row) -> float:
    low, high = row['interval'] or (row['value'], row['value'])
    return (high - low) / 2 / row['value']
