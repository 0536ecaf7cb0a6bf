"""What the fast learner believes at one instant; a question changes nothing."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_learning.core.gaze_line_mixture import LineMixture, powers
from ja_learning.core.gaze_line_places import (
    ANGLE_SCALE_RAD,
    COVARIANCE,
    FROM_EYES,
    HER_DISTANCE,
    IN_VIEW,
    known_from_eyes,
    seen_places,
)
from ja_learning.core.trial import Look


class GazeLineBelief:
    """A mixture of members, each a map from faces to gazes, and its weight.

    `read`: what it reads of a look, or None where the look does not show it. `gaze_of`: the gazes
    (members, n, 2) of n faces as they are read; `mixture`: the other numbers of the members, (or
    1, 1, stretches or 1). `top_down`: propose the most probable of the objects seen,
    where one is plausible; else always the best guess on the line of gaze.
    `plausible_within_nats`: how much less probable than the best guess an object may be. `surest`:
    the member that makes the best guess; None: that of the largest weight.
    `calibrated`: whether its probabilities can be taken at their word (`expected_gain`).
    """

    def __init__(
        self,
        read: Callable[[Look], NDArray[Any] | None],
        gaze_of: Callable[[NDArray[Any]], NDArray[np.float64]],
        mixture: LineMixture[NDArray[np.float64]],
        log_weights: NDArray[np.float64],
        log_evidence: float,
        top_down: bool,
        plausible_within_nats: float,
        surest: int | None = None,
        calibrated: bool = True,
    ) -> None:
        self._calibrated = calibrated
        self._log_weights = log_weights
        self._read, self._gaze_of, self._mixture = read, gaze_of, mixture
        self._surest = int(np.argmax(log_weights)) if surest is None else surest
        self._top_down, self._plausible_within = top_down, plausible_within_nats
        self.log_evidence = log_evidence
        self._coded: _Coded | None = None

    def propose(
        self,
        look: Look,
        posture: ArrayLike,
        candidates: ArrayLike,
        ranges: ArrayLike | None = None,
    ) -> NDArray[np.float64] | None:
        """Return a change of posture (2,) [rad] towards the most probable gaze target.

        As in `Predictor`: None where the look shows nothing that it reads.
        """
        coded = self._code(look)
        if coded is None:
            return None
        aim = coded.best_guess
        if self._top_down and len(places := seen_places(look, candidates, ranges)):
            density = self._density(coded, places)
            best = int(np.argmax(density))
            if density[best] > self._peak(coded, places[best]) - self._plausible_within:
                aim = places[best, IN_VIEW] * ANGLE_SCALE_RAD
        return look.face_at + aim - np.asarray(posture, float)

    def probabilities(
        self, look: Look, candidates: ArrayLike, ranges: ArrayLike | None = None
    ) -> NDArray[np.float64] | None:
        """Return the probability (m,) of each of candidates (m, 2) [rad] to be the gaze target.

        Given that one of them is. `ranges` (m, 2) [m]: as in `Trial`. None where the look shows
        nothing that it reads.
        """
        coded = self._code(look)
        if coded is None:
            return None
        density = self._density(coded, seen_places(look, candidates, ranges))
        shares = np.exp(density - density.max(initial=-np.inf))
        return np.asarray(shares / shares.sum())

    def expected_gain(
        self, look: Look, candidates: ArrayLike, ranges: ArrayLike | None = None
    ) -> float:
        """Return how much better than chance the most probable of the candidates is, as believed.

        As in `Predictor`: (q - c) / (1 - c) with its probability q and c = 1 / m.
        """
        count = len(np.asarray(candidates))
        if count < 2 or not self._calibrated:
            return math.nan
        shares = self.probabilities(look, candidates, ranges)
        if shares is None:
            return math.nan
        return float((shares.max() - 1 / count) / (1 - 1 / count))

    def belief(self, look: Look, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Draw directions (count, 2) [rad] from the belief about the gaze target."""
        coded, mixture = self._code(look), self._mixture
        if coded is None:
            return np.empty((0, 2))
        shares = np.exp(mixture.log_shares[:, 0])
        weights = np.exp(self._log_weights)
        member = rng.choice(len(weights), count, p=weights / weights.sum())
        at = (rng.random((count, 1)) > np.cumsum(shares, axis=1)[member]).sum(axis=1)
        at = np.minimum(at, shares.shape[1] - 1)
        of_stretch, of_gaze, of_place = (
            np.sqrt(np.broadcast_to(variance, (len(weights), 1, 1))[member, 0])
            for variance in (mixture.of_stretch, mixture.of_gaze, mixture.of_place)
        )
        line = np.stack(mixture.on_line(*coded.gaze), axis=-1)[member, 0, at]
        gaze = np.concatenate(coded.gaze, axis=-1)[member, 0]
        off = of_stretch * rng.standard_normal((count, 1)) * gaze
        off += of_gaze * rng.standard_normal((count, 2))
        places = line + mixture.stretches[at, None] * off
        places += of_place * rng.standard_normal((count, 2))
        return look.face_at + places * ANGLE_SCALE_RAD

    def log_density(
        self, faces: ArrayLike, face_at: ArrayLike, directions: ArrayLike
    ) -> NDArray[np.float64]:
        """Return log p, (n, m) [of 1 / rad^2], of directions (m, 2) given n faces.

        The faces are as they are read; the distances of things are unknown.
        """
        places = np.asarray(directions, float).reshape(-1, 2) - np.asarray(face_at, float)
        parts = self._parts(self._forms(self._gaze(np.asarray(faces))), places / ANGLE_SCALE_RAD)
        return np.logaddexp.reduce(parts, axis=(0, 3)) - 2 * np.log(ANGLE_SCALE_RAD)

    def _code(self, look: Look) -> '_Coded | None':
        """Code a face, once a trial: the same look comes with every image of it."""
        if self._coded is None or self._coded.look is not look:
            face = self._read(look)
            if face is None:
                return None
            gaze = self._gaze(face[None])
            forms = self._forms(gaze)
            guesses = np.stack(self._mixture.on_line(*gaze), axis=-1)[self._surest, 0]
            density = np.logaddexp.reduce(self._parts(forms, guesses), axis=(0, 3))[0]
            best = int(np.argmax(density))
            best_guess = guesses[best] * ANGLE_SCALE_RAD
            self._coded = _Coded(look, gaze, forms, best_guess, float(density[best]))
        return self._coded

    def _gaze(self, faces: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return u of n faces as they are read, pan and tilt, each (members, n, 1)."""
        gaze = self._gaze_of(faces)
        return gaze[..., :1], gaze[..., 1:]

    def _forms(self, gaze: tuple[NDArray[np.float64], NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the forms of gazes, (members, n, 6, stretches)."""
        return np.stack(self._mixture.forms(*gaze, np.log), axis=2)

    def _parts(
        self, forms: NDArray[np.float64], places: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return log p of places (m, 2) at each stretch, (members, n, m, stretches)."""
        parts: NDArray[np.float64] = np.stack(powers(*places.T), axis=-1) @ forms
        parts += self._log_weights[:, None, None, None]
        return parts

    def _density(self, coded: '_Coded', places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return log p (m,) of candidates, rows of places: once for proposal and gain."""
        if coded.asked is None or not np.array_equal(coded.asked[0], places, equal_nan=True):
            coded.asked = places, self._mixed(coded, places)[0]
        return coded.asked[1]

    def _mixed(self, coded: '_Coded', places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return log p of rows (m, 8) of places, given a face: (1, m)."""
        parts, known = self._parts(coded.forms, places[:, IN_VIEW]), known_from_eyes(places)
        if not known.any():
            return np.logaddexp.reduce(parts, axis=(0, 3))
        of_members = np.logaddexp.reduce(parts, axis=3)
        from_eyes = self._mixture.log_from_eyes(
            coded.gaze,
            [*places[known, FROM_EYES].T],
            places[known, HER_DISTANCE],
            [*places[known, COVARIANCE].T],
            np.log,
            np.exp,
        )
        of_members[..., known] = from_eyes + self._log_weights[:, None, None]
        return np.logaddexp.reduce(of_members, axis=0)

    def _peak(self, coded: '_Coded', place: NDArray[np.float64]) -> float:
        """Return log p of the best guess, as far away as this row (8,) of places is."""
        if not known_from_eyes(place):
            return coded.log_density_there
        guess, surest = place.copy(), self._surest
        pan, tilt = (float(each[surest, 0, 0]) for each in coded.gaze)
        origins = np.broadcast_to(self._mixture.origin_tilt, (len(self._log_weights), 1, 1))
        origin = float(origins[surest, 0, 0]) * place[HER_DISTANCE]
        guess[FROM_EYES] = pan, tilt + origin
        return float(self._mixed(coded, guess[None])[0, 0])


class AnswersFromSnapshot:
    """A learner that answers with what it believes now, its snapshot."""

    def snapshot(self) -> GazeLineBelief:
        """Return what is believed now; no later update changes it."""
        raise NotImplementedError

    def propose(
        self,
        look: Look,
        posture: ArrayLike,
        candidates: ArrayLike,
        ranges: ArrayLike | None = None,
    ) -> NDArray[np.float64] | None:
        """Return a change of posture (2,) [rad] towards the most probable gaze target."""
        return self.snapshot().propose(look, posture, candidates, ranges)

    def expected_gain(
        self, look: Look, candidates: ArrayLike, ranges: ArrayLike | None = None
    ) -> float:
        """Return how much better than a choice by chance its choice is, by what it believes."""
        return self.snapshot().expected_gain(look, candidates, ranges)

    def belief(self, look: Look, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Draw directions (count, 2) [rad] from the belief about the gaze target."""
        return self.snapshot().belief(look, rng, count)


@dataclass
class _Coded:
    """One face, coded: its gazes, pan and tilt, and their forms.

    `best_guess`: (2,) [rad] on the line of gaze of the surest member. `asked`: the candidates that
    were asked about last, and log p of each.
    """

    look: Look
    gaze: tuple[NDArray[np.float64], NDArray[np.float64]]
    forms: NDArray[np.float64]
    best_guess: NDArray[np.float64]
    log_density_there: float
    asked: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
