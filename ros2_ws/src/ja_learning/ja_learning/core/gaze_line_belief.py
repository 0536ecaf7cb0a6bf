"""What the fast learner believes at one instant; asking it changes nothing."""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from ja_learning.core.gaze_line_network import (
    ANGLE_SCALE_RAD,
    STRETCHES,
    GazeLineNetwork,
    quadratic,
    standardised,
)


class GazeLineBelief:
    """A mixture of the members of a network, each with its weight.

    `top_down`: propose the most probable of the objects seen, where one is plausible; else always
    the best guess on the line of gaze. `plausible_within_nats`: how much less probable than the
    best guess an object may be.
    """

    def __init__(
        self,
        network: GazeLineNetwork,
        log_weights: NDArray[np.float64],
        log_evidence: float,
        top_down: bool,
        plausible_within_nats: float,
    ) -> None:
        self._network, self._log_weights = network, log_weights
        self._top_down, self._plausible_within = top_down, plausible_within_nats
        self.log_evidence = log_evidence
        self._coded: _Coded | None = None

    def propose(
        self, face: ArrayLike, face_at: ArrayLike, posture: ArrayLike, candidates: ArrayLike
    ) -> NDArray[np.float64]:
        """Change of posture (2,) [rad] towards what she most probably means; as in `Predictor`."""
        origin = np.asarray(face_at, float)
        coded = self._code(face)
        aim = coded.best_guess
        if self._top_down and len(places := np.asarray(candidates, float).reshape(-1, 2) - origin):
            density = self._mixed(coded.forms, places)[0]
            best = int(np.argmax(density))
            if density[best] > coded.log_density_there - self._plausible_within:
                aim = places[best]
        return origin + aim - np.asarray(posture, float)

    def belief(
        self, face: ArrayLike, face_at: ArrayLike, rng: np.random.Generator, count: int
    ) -> NDArray[np.float64]:
        """Directions (count, 2) [rad] drawn from the belief about what she means."""
        net = self._network
        with torch.no_grad():
            shares = torch.softmax(net.stretch_logits, dim=-1).numpy().astype(float)
            of_stretch, of_gaze, of_place = (
                torch.exp(logs).numpy().astype(float)
                for logs in (
                    net.log_stretch_deviation,
                    net.log_gaze_deviation,
                    net.log_place_deviation,
                )
            )
            gaze = self._code(face).gaze
            line = net.on_line(gaze)[:, 0].numpy().astype(float)
        member = rng.choice(len(shares), count, p=_normalised(np.exp(self._log_weights)))
        at = (rng.random((count, 1)) > np.cumsum(shares, axis=1)[member]).sum(axis=1)
        at = np.minimum(at, len(STRETCHES) - 1)
        along = of_stretch[member] * rng.standard_normal((count, 1)) * gaze[member, 0].numpy()
        around = of_gaze[member] * rng.standard_normal((count, 2))
        near = of_place[member] * rng.standard_normal((count, 2))
        places = line[member, at] + STRETCHES.numpy()[at, None] * (along + around) + near
        return np.asarray(face_at, float) + places * ANGLE_SCALE_RAD

    def log_density(
        self, faces: ArrayLike, face_at: ArrayLike, directions: ArrayLike
    ) -> NDArray[np.float64]:
        """log p [of 1 / rad^2] of directions (m, 2) given each of faces (n, 30, 25): (n, m)."""
        places = np.asarray(directions, float).reshape(-1, 2) - np.asarray(face_at, float)
        with torch.no_grad():
            forms = self._network.forms(self._gaze(faces))
        return self._mixed(forms, places) - 2 * np.log(ANGLE_SCALE_RAD)

    def _code(self, face: ArrayLike) -> '_Coded':
        """One face is asked about on every image of a trial: coded once."""
        if self._coded is None or self._coded.face is not face:
            surest = int(np.argmax(self._log_weights))
            with torch.no_grad():
                gaze = self._gaze(face)
                forms, line = self._network.forms(gaze), self._network.on_line(gaze)[surest, 0]
            guesses = line.numpy().astype(float) * ANGLE_SCALE_RAD
            density = self._mixed(forms, guesses)[0]
            best = int(np.argmax(density))
            self._coded = _Coded(face, gaze, forms, guesses[best], float(density[best]))
        return self._coded

    def _gaze(self, faces: ArrayLike) -> torch.Tensor:
        """u, (members, n, 2)."""
        pictures = np.array(faces, np.uint8).reshape(-1, 1, *np.shape(faces)[-2:])
        with torch.no_grad():
            return self._network.gaze(standardised(pictures))

    def _mixed(self, forms: torch.Tensor, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """log p of places (m, 2) [rad], given the forms of n gazes: (n, m)."""
        scaled = torch.from_numpy((places / ANGLE_SCALE_RAD).astype(np.float32))
        with torch.no_grad():
            density = torch.logsumexp(quadratic(scaled) @ forms, dim=-1).numpy().astype(float)
        return np.logaddexp.reduce(density + self._log_weights[:, None, None], axis=0)


@dataclass(frozen=True)
class _Coded:
    """What one face says: its gazes u (members, 1, 2), their forms, and the best guess (2,) [rad]
    on the line of gaze of the surest member, with its log density.
    """

    face: ArrayLike
    gaze: torch.Tensor
    forms: torch.Tensor
    best_guess: NDArray[np.float64]
    log_density_there: float


def _normalised(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    return shares / shares.sum()
