"""The simulated environment of section 3.1: one look of the pool, other objects at random.

Every draw comes from the one generator of the run, in the order that is written here; the fast
kernel makes the same draws in the same order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ja_common.core.detection import Detection, Kind
from ja_common.core.geometry import rays_of_directions, vectors_of_directions
from ja_experiments.config import TaskConfig
from ja_experiments.datasets.looks import Looks
from ja_perception.core.salient_objects import InterestConfig
from ja_sim.core.specs import ObjectsSpec

ATTENDED = 0
"""Index of the object that the caregiver attends to."""


@dataclass(frozen=True)
class Setting:
    """One trial's environment.

    `look`: index of the look; `directions`: (n, 2) [rad] of the objects, the attended one first;
    `features`: (n, 3), f_col, f_edg and f_mot of each.
    """

    look: int
    directions: NDArray[np.float64]
    features: NDArray[np.float64]


class SimulatedTask:
    """A source of random settings, and of what a camera would detect in them."""

    def __init__(
        self, config: TaskConfig, interest: InterestConfig, places: ObjectsSpec, looks: Looks
    ) -> None:
        self._config, self._places, self._looks = config, places, looks
        self._alpha = np.array([interest.alpha_col, interest.alpha_edg, interest.alpha_mot])
        self._half_view = np.tan([config.view_pan_rad, config.view_tilt_rad])

    def draw_setting(self, rng: np.random.Generator) -> Setting:
        """Draw the environment of the next trial."""
        look = int(rng.random() * len(self._looks))
        reliable = rng.random() < self._config.reliability
        directions = np.empty((self._config.objects, 2))
        for index in range(self._config.objects):
            if index == ATTENDED and reliable:
                directions[index] = self._looks.directions[look]
            else:
                directions[index] = self._free_place(rng, look, directions[:index])
        features = np.zeros((self._config.objects, 3))
        for index in range(self._config.objects):
            features[index, :2] = rng.random(), rng.random()
        features[ATTENDED, 2] = self._config.shakes_object
        return Setting(look, directions, features)

    def in_view(self, posture: NDArray[np.float64], direction: NDArray[np.float64]) -> bool:
        """Return whether a direction is within the picture taken from a posture."""
        return bool(np.all(np.abs(rays_of_directions(posture, direction)) < self._half_view))

    def detections(self, setting: Setting, posture: NDArray[np.float64]) -> list[Detection]:
        """Return what a perfect detector sees from a posture: the face, if in view, then objects.

        As in Eq. 1, an object without a feature of interest is not detected.
        """
        face = self._looks.faces_at[setting.look]
        found = []
        if self.in_view(posture, face):
            found.append(
                _detection(Kind.FACE, rays_of_directions(posture, face), 1.0, np.zeros(3))
            )
        rays = rays_of_directions(posture, setting.directions)
        for ray, features in zip(rays, setting.features, strict=True):
            score = float(self._alpha @ features)
            if score > 0 and np.all(np.abs(ray) < self._half_view):
                found.append(_detection(Kind.OBJECT, ray, score, features))
        return found

    def _free_place(
        self, rng: np.random.Generator, look: int, taken: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Draw a direction [rad] that keeps its gap to the face and to the objects in `taken`."""
        places = self._places
        pan, tilt = np.radians(places.pan_deg), np.radians(places.tilt_deg)
        face = vectors_of_directions(self._looks.faces_at[look])
        others = vectors_of_directions(taken)
        while True:
            direction = np.array([rng.uniform(*pan), rng.uniform(*tilt)])
            vector = vectors_of_directions(direction)
            if face @ vector < np.cos(np.radians(places.gap_to_face_deg)) and np.all(
                others @ vector < np.cos(np.radians(places.gap_deg))
            ):
                return direction


def _detection(
    kind: Kind, ray: NDArray[np.float64], score: float, features: NDArray[np.float64]
) -> Detection:
    x, y = map(float, ray)
    f_col, f_edg, f_mot = map(float, features)
    # The simulated camera has no pixels: boxes are not used by the controller and the evaluator.
    return Detection(
        kind, x, y, 0.0, 0.0, 0.0, 0.0, score, f_col=f_col, f_edg=f_edg, f_mot=f_mot,
        attended=kind is Kind.FACE,
    )  # fmt: skip
