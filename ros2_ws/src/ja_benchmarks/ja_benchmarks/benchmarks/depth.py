"""The accuracy and the speed of ranges: by a depth picture and by a second camera.

In the simulated room, with the errors of a real depth sensor, and a second camera 6 cm to the
right. The truth is the visible surface of a thing in the exact depth of the scene, and the centre
of an object. Rows are ``{'value', 'unit', 'n', 'interval'}`` with a 95 % interval.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_benchmarks.rows import Row, percentile_99, row, share_row
from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind
from ja_common.core.geometry import angle_between, directions_of_rays, head_rotation
from ja_common.core.posture import Posture
from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.depth_ranges import DepthPicture
from ja_perception.core.detector import SalientFeatureDetector
from ja_perception.core.ranging import ImageRegion, RangeSensor
from ja_perception.core.stereo_ranges import SecondView
from ja_sim.core.camera import Observation
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld, WorldTruth

SIZES = ((320, 240), (640, 480))
SEEDS, VIEWS = 30, 4
"""So many rooms with another caregiver, light and objects; views of each, the first of her."""
_LOOKS = 6  # images until a face counts as seen
_OBJECT_M = 0.06  # no object reaches farther from its centre
_SAME = np.radians(2.0)


def run() -> dict[str, Row]:
    """Measure all figures of ranges."""
    cv2.setNumThreads(1)
    rows: dict[str, Row] = {}
    for size in SIZES:
        measured = {name: _Measured() for name in ('depth picture', 'second camera')}
        for view in _views(size):
            for name, sensor in view.sensors().items():
                measured[name].record_view(view, sensor)
        for name, found in measured.items():
            rows |= {f'{name}, {size[0]}x{size[1]}: {k}': v for k, v in found.rows().items()}
    return rows


@dataclass(frozen=True)
class _View:
    """One picture with all that measures its depth, and the truth."""

    observation: Observation
    exact: NDArray[np.float32]
    truth: WorldTruth
    baseline_m: float

    @property
    def camera(self) -> CameraModel:
        lens = self.observation.intrinsics
        return CameraModel(lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy)

    def sensors(self) -> dict[str, RangeSensor]:
        seen = self.observation
        assert seen.depth is not None
        assert seen.right is not None
        return {
            'depth picture': DepthPicture(seen.depth),
            'second camera': SecondView(seen.right, seen.fx * self.baseline_m),
        }

    def surface_m(self, detection: Detection) -> tuple[float, float]:
        """Return the true range of what was detected, and of its centre [m]; NaN if unknown."""
        stretch = float(np.hypot(1.0, np.hypot(*detection.ray)))
        if detection.kind is Kind.FACE:
            half = round(detection.width / 6)
            u, v = round(detection.u), round(detection.v)
            middle = self.exact[max(0, v - half) : v + half + 1, max(0, u - half) : u + half + 1]
            return stretch * float(np.median(middle)), np.nan
        ray = directions_of_rays(self.truth.posture, detection.ray)
        off = angle_between(self.truth.directions, ray)
        nearest = int(off.argmin())
        if off[nearest] > _SAME:
            return np.nan, np.nan
        centre = self.truth.positions[nearest]
        own = np.linalg.norm(self._points - centre @ head_rotation(self.truth.posture), axis=-1)
        depths = self.exact[own < _OBJECT_M]
        surface = stretch * float(np.median(depths)) if depths.size else np.nan
        return surface, float(np.linalg.norm(centre))

    @property
    def _points(self) -> NDArray[np.float64]:
        """Return the visible surface at each pixel, (H, W, 3) [m] in the frame of the head."""
        v, u = np.indices(self.exact.shape)
        x, y = np.moveaxis(self.camera.rays(np.stack([u, v], axis=-1)), -1, 0)
        return self.exact[..., None] * np.stack([np.ones_like(x), -x, -y], axis=-1)


@dataclass
class _Measured:
    """What one sensor measured in all views: errors relative to the range, by kind."""

    errors: dict[Kind, list[float]] = field(default_factory=lambda: {kind: [] for kind in Kind})
    to_centres: list[float] = field(default_factory=list)
    within: list[bool] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    regions: list[int] = field(default_factory=list)

    def record_view(self, view: _View, sensor: RangeSensor) -> None:
        """Detect until a face is known, and compare what is then detected with the truth."""
        seen, timed = view.observation, _Timed(sensor)
        detector = SalientFeatureDetector(BlazeFace())
        for number in range(_LOOKS):
            stamp_ns = seen.stamp_ns + number
            posture = Posture(stamp_ns, view.truth.posture, np.zeros(2))
            percept = detector.detect(seen.image, stamp_ns, view.camera, posture, timed)
        self.seconds += timed.seconds[1:]
        self.regions.append(len(percept.detections))
        for detection in percept.detections:
            surface, centre = view.surface_m(detection)
            if np.isnan(surface):
                continue
            self.errors[detection.kind].append(detection.range_m / surface - 1)
            if np.isfinite(detection.range_m):
                off = abs(detection.range_m - surface)
                self.within.append(off < 2 * detection.range_deviation_m)
                if detection.kind is Kind.OBJECT:
                    self.to_centres.append(detection.range_m / centre - 1)

    def rows(self) -> dict[str, Row]:
        """Return the rows of this sensor."""
        rows = {}
        for kind, errors in self.errors.items():
            name, found = kind.name.lower(), np.array(errors)
            known = np.isfinite(found)
            rows[f'{name}, range known'] = share_row(known)
            rows[f'{name}, median error'] = row(100 * np.abs(found[known]), '%', np.median)
            rows[f'{name}, 99 % of errors below'] = row(
                100 * np.abs(found[known]), '%', percentile_99
            )
        rows['object, median against its centre'] = row(
            100 * np.array(self.to_centres), '%', np.median
        )
        rows['within two of its deviations'] = share_row(self.within)
        rows['regions an image'] = row(self.regions, '')
        milliseconds = 1000 * np.array(self.seconds)
        rows['processor time an image, median'] = row(milliseconds, 'ms', np.median)
        rows['processor time an image, 99 %'] = row(milliseconds, 'ms', percentile_99)
        return rows


class _Timed:
    """A sensor whose processor time is measured: of one thread, whatever else the machine does."""

    def __init__(self, sensor: RangeSensor) -> None:
        self._sensor = sensor
        self.seconds: list[float] = []

    def check(self, image: NDArray[np.uint8]) -> None:
        self._sensor.check(image)

    def depths(
        self, image: NDArray[np.uint8], regions: Sequence[ImageRegion], camera: CameraModel
    ) -> NDArray[np.float64]:
        start = time.thread_time()
        found = self._sensor.depths(image, regions, camera)
        self.seconds.append(time.thread_time() - start)
        return found


def _views(size: tuple[int, int]) -> Iterator[_View]:
    """Yield views of rooms: of her face first, then of one object after the other."""
    scene = load_scene('default')
    senses = replace(scene.senses, depth='sensor', second_camera=True)
    measured = replace(scene, senses=senses)
    exact = replace(scene, senses=replace(senses, depth='exact', second_camera=False))
    for seed in range(SEEDS):
        worlds = [JointAttentionWorld(each, seed, size) for each in (measured, exact)]
        for number in range(VIEWS):
            truth = worlds[0].truth()
            place = truth.directions[number - 1] if number else truth.face_direction
            for world in worlds:
                world.command(place)
                world.step(1.0)
            seen, truly = (world.observe() for world in worlds)
            assert truly.depth is not None
            yield _View(seen, truly.depth, worlds[0].truth_at_exposure(), senses.baseline_m)
        for world in worlds:
            world.close()
