"""Does memory stay flat? Resident memory of the whole graph over many lockstep steps."""

import numpy as np
import psutil
from scipy.stats import linregress

from ja_benchmarks.benchmarks.graph import run_for_benchmark
from ja_benchmarks.rows import Row
from ja_runner.graph import sim_graph
from ja_runner.progress import ProgressNode

IMAGES = 100_000
EVERY_IMAGES = 500
# The first part fills histories and caches.
SETTLED_SHARE = 0.25
# The fast learner keeps 5000 trials for replay, so its memory grows over 45 000 images by design.
LEARNER = 'paper'
_MB = 2**20


def run(images: int = IMAGES) -> dict[str, Row]:
    """Run all nodes in one process, at 160x120, and sample the resident memory."""
    counts: list[int] = []
    resident_mb: list[float] = []

    def sample(node: ProgressNode) -> bool:
        if node.images >= EVERY_IMAGES * (len(counts) + 1):
            counts.append(node.images)
            resident_mb.append(_resident_mb())
        return node.images >= images

    sim = {'scene': 'default', 'image_width': 160, 'image_height': 120}
    run_for_benchmark(sim_graph(0, sim, LEARNER), sample, one_process=True)
    settled = slice(int(SETTLED_SHARE * len(counts)), None)
    line = linregress(1e-3 * np.array(counts[settled]), resident_mb[settled])
    half = 1.96 * line.stderr
    return {
        'resident memory, settled': _mb(resident_mb[settled][0]),
        f'resident memory, after {images} images': _mb(resident_mb[-1]),
        'growth once settled': {
            'value': float(line.slope),
            'unit': 'MB/1000 images',
            'n': len(resident_mb[settled]),
            'interval': [float(line.slope - half), float(line.slope + half)],
        },
    }


def _mb(value: float) -> Row:
    return {'value': value, 'unit': 'MB', 'n': 1, 'interval': None}


def _resident_mb() -> float:
    return psutil.Process().memory_info().rss / _MB
