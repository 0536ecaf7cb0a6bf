"""What the fast learner believes at one instant; a question changes nothing."""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from ja_learning.core.gaze_line_mixture import LineMixture, powers
from ja_learning.core.gaze_line_network import ANGLE_SCALE_RAD, GazeLineNetwork
from ja_learning.core.gaze_line_pass import GazeLinePass


class GazeLineBelief:
    """A mixture of the members of a network as it is now, each with its weight.

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
        self._log_weights = log_weights
        self._pass, self._mixture = GazeLinePass(network), _numpy(network.mixture())
        self._top_down, self._plausible_within = top_down, plausible_within_nats
        self.log_evidence = log_evidence
        self._coded: _Coded | None = None

    def propose(
        self, face: ArrayLike, face_at: ArrayLike, posture: ArrayLike, candidates: ArrayLike
    ) -> NDArray[np.float64]:
        """Return a change of posture (2,) [rad] towards the most probable gaze target."""
        origin = np.asarray(face_at, float)
        coded = self._code(face)
        aim = coded.best_guess
        if self._top_down and len(places := np.asarray(candidates, float).reshape(-1, 2) - origin):
            density = self._mixed(coded.forms, places / ANGLE_SCALE_RAD)[0]
            best = int(np.argmax(density))
            if density[best] > coded.log_density_there - self._plausible_within:
                aim = places[best]
        return origin + aim - np.asarray(posture, float)

    def belief(
        self, face: ArrayLike, face_at: ArrayLike, rng: np.random.Generator, count: int
    ) -> NDArray[np.float64]:
        """Draw directions (count, 2) [rad] from the belief about the gaze target."""
        coded, mixture = self._code(face), self._mixture
        shares = np.exp(mixture.log_shares[:, 0])
        weights = np.exp(self._log_weights)
        member = rng.choice(len(weights), count, p=weights / weights.sum())
        at = (rng.random((count, 1)) > np.cumsum(shares, axis=1)[member]).sum(axis=1)
        at = np.minimum(at, shares.shape[1] - 1)
        of_stretch, of_gaze, of_place = (
            np.sqrt(variance[member, 0])
            for variance in (mixture.of_stretch, mixture.of_gaze, mixture.of_place)
        )
        line = np.stack(mixture.on_line(*coded.gaze), axis=-1)[member, 0, at]
        gaze = np.concatenate(coded.gaze, axis=-1)[member, 0]
        off = of_stretch * rng.standard_normal((count, 1)) * gaze
        off += of_gaze * rng.standard_normal((count, 2))
        places = line + mixture.stretches[at, None] * off
        places += of_place * rng.standard_normal((count, 2))
        return np.asarray(face_at, float) + places * ANGLE_SCALE_RAD

    def log_density(
        self, faces: ArrayLike, face_at: ArrayLike, directions: ArrayLike
    ) -> NDArray[np.float64]:
        """Return log p, (n, m) [of 1 / rad^2], of directions (m, 2) given faces (n, 30, 25)."""
        places = np.asarray(directions, float).reshape(-1, 2) - np.asarray(face_at, float)
        forms = self._forms(self._gaze(faces))
        return self._mixed(forms, places / ANGLE_SCALE_RAD) - 2 * np.log(ANGLE_SCALE_RAD)

    def _code(self, face: ArrayLike) -> '_Coded':
        """Code a face, once a trial: the same one comes with every image of it."""
        if self._coded is None or self._coded.face is not face:
            gaze = self._gaze(face)
            forms = self._forms(gaze)
            surest = int(np.argmax(self._log_weights))
            guesses = np.stack(self._mixture.on_line(*gaze), axis=-1)[surest, 0]
            density = self._mixed(forms, guesses)[0]
            best = int(np.argmax(density))
            best_guess = guesses[best] * ANGLE_SCALE_RAD
            self._coded = _Coded(face, gaze, forms, best_guess, float(density[best]))
        return self._coded

    def _gaze(self, faces: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return u of n faces, pan and tilt, each (members, n, 1)."""
        gaze = self._pass(np.reshape(faces, (-1, *np.shape(faces)[-2:])))
        return gaze[..., :1], gaze[..., 1:]

    def _forms(self, gaze: tuple[NDArray[np.float64], NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the forms of gazes, (members, n, 6, stretches)."""
        return np.stack(self._mixture.forms(*gaze, np.log), axis=2)

    def _mixed(
        self, forms: NDArray[np.float64], places: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return log p of places (m, 2), given the forms of n gazes: (n, m)."""
        parts = np.stack(powers(*places.T), axis=-1) @ forms
        parts += self._log_weights[:, None, None, None]
        return np.logaddexp.reduce(parts, axis=(0, 3))


@dataclass(frozen=True)
class _Coded:
    """One face, coded: its gazes, pan and tilt, and their forms.

    `best_guess`: (2,) [rad] on the line of gaze of the surest member.
    """

    face: ArrayLike
    gaze: tuple[NDArray[np.float64], NDArray[np.float64]]
    forms: NDArray[np.float64]
    best_guess: NDArray[np.float64]
    log_density_there: float


def _numpy(mixture: LineMixture[torch.Tensor]) -> LineMixture[NDArray[np.float64]]:
    arrays = {name: value.detach().numpy().astype(float) for name, value in vars(mixture).items()}
    return LineMixture(**arrays)
