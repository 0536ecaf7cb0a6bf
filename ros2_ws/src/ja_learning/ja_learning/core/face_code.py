"""A face code: two numbers of a face, one odd and one even in a mirror, read by a small network.

The principal components of her faces (`eigenfaces`) spread one turn of the head over several
numbers. A network that was trained beforehand, without any label of a gaze, puts it into one: so
a map from features to her gaze has fewer parameters, and fewer trials find it. What the numbers
mean is learned as before, by trials (`gaze_posterior`). There are two ways to train one:
`watched_face_code` and `others_face_code`; each is a track of its own (`track`).
"""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from ja_common.core.config import ConfigError
from ja_common.core.safe_files import read_bytes
from ja_common.core.weight_files import read_weights
from ja_learning.core.checkpoint import load_checkpoint, save_checkpoint
from ja_learning.core.checkpoint_arrays import numbers
from ja_learning.core.gaze_features import Features
from ja_learning.core.gaze_line_network import GazeLineNetwork
from ja_learning.core.gaze_line_pass import GazeLinePass
from ja_learning.core.trial import FACE_SHAPE

WATCHED, OTHERS = 'watched', 'others'
"""What a code was trained on: her own pictures, or candidate sets of other caregivers."""

CHANNELS = 8
PRIOR = Features(np.array([0.7, 0.2, 0.3]), np.array([0.35, 0.1, 0.1, 0.2]))
"""Deviations of the weights of the features before any trial; the last even feature is 1."""

_KIND = 'face_code'
_LARGEST_BYTES = 2**20
_NETWORK = 'network.'
_MOST_DEVIATION, _MOST_BRIGHTNESS = 1e3, 1e3


@dataclass(frozen=True)
class CodeOrigin:
    """What a code was trained on: `WATCHED` or `OTHERS`, and how much of it.

    `seconds`: of pictures that were watched. `caregivers`: how many there were, and `people`: who;
    `trials`: how many candidate sets.
    """

    trained_on: str
    seconds: float = 0.0
    caregivers: int = 1
    people: tuple[str, ...] = ()
    trials: int = 0


class FaceCode:
    """A trained network that reads two numbers of a face, and the features that they offer.

    `sha256`: of its file, in hexadecimal; '' before it has one.
    """

    sha256 = ''

    def __init__(
        self,
        network: GazeLineNetwork,
        deviations: NDArray[np.float64],
        origin: CodeOrigin,
        mean_face: NDArray[np.float32] | None = None,
    ) -> None:
        """Take a network of one member.

        `deviations` (2,): of its outputs over the faces it was trained on. `mean_face` (30, 25):
        of the person, if there was only one.
        """
        self._network, self._deviations = network, deviations
        self._read = GazeLinePass(network)
        self.origin, self.mean_face = origin, mean_face

    def numbers(self, faces: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the two numbers (n, 2) of contrasts (n, 30, 25), of deviation 1 in training."""
        return np.asarray(self._read(faces)[0], float) / self._deviations

    def features(self, faces: NDArray[np.floating]) -> Features:
        """Return the features of contrasts (n, 30, 25): pan (n, 3), tilt (n, 4).

        These are the two numbers, and what bends the map a little.
        """
        odd, even = self.numbers(faces).T
        return Features(
            np.stack([odd, odd**3 / 3, odd * even], axis=1),
            np.stack([even, even**2 / 2, odd**2 / 2, np.ones_like(even)], axis=1),
        )

    def state(self) -> dict[str, NDArray[Any]]:
        """Return the code as named arrays."""
        kept = self._network.state_dict()
        arrays = {f'{_NETWORK}{name}': each.numpy().copy() for name, each in kept.items()}
        arrays['deviations'] = self._deviations.copy()
        if self.mean_face is not None:
            arrays['mean_face'] = self.mean_face.copy()
        return arrays


def member_alone(network: GazeLineNetwork, which: int) -> GazeLineNetwork:
    """Return one member of a trained network as a network of its own."""
    alone = _network()
    for taken, given in zip(alone.parameters(), network.parameters(), strict=True):
        taken.copy_(given.detach().reshape(network.members, -1)[which].reshape(taken.shape))
    return alone


def save_face_code(path: Path, code: FaceCode) -> None:
    """Write a code as a checkpoint is written: all of it or nothing. Raises SaveError."""
    save_checkpoint(path, code.state(), {'kind': _KIND, **asdict(code.origin)})


def load_face_code(path: Path, trained_on: str | None = None) -> FaceCode:
    """Return the code of a file, which is noted as a file of weights (`weight_files`).

    `trained_on`: what it must have been trained on, as a track demands. Raises ConfigError when
    there is no such file, or it is no code, or one that was trained on something else.
    """
    read_bytes(path, _LARGEST_BYTES)
    digest = hashlib.sha256(read_weights(path)).hexdigest()
    try:
        code = _code_of(*load_checkpoint(path))
    except (ValueError, FileNotFoundError) as error:
        raise ConfigError(f'{path} is no face code: {error}') from None
    code.sha256 = digest
    if trained_on not in (None, code.origin.trained_on):
        raise ConfigError(
            f'{path} was trained on {code.origin.trained_on}, not on {trained_on}: it is of '
            'another track'
        )
    return code


def _network() -> GazeLineNetwork:
    """Return a network of one member, to be filled; no other random numbers are drawn."""
    with torch.random.fork_rng(devices=[]):
        return GazeLineNetwork(1, CHANNELS).requires_grad_(False)


def _code_of(arrays: Mapping[str, NDArray[Any]], description: Mapping[str, Any]) -> FaceCode:
    if description.get('kind') != _KIND:
        raise ValueError(f'it is a {str(description.get("kind"))[:50]!r}')
    network = _network()
    network.load_state_dict(
        {
            name: torch.from_numpy(numbers(arrays, _NETWORK + name, tuple(each.shape)))
            for name, each in network.state_dict().items()
        }
    )
    deviations = numbers(
        arrays, 'deviations', (2,), np.float64, low=1 / _MOST_DEVIATION, high=_MOST_DEVIATION
    )
    mean_face = None
    if 'mean_face' in arrays:
        limit = _MOST_BRIGHTNESS
        mean_face = numbers(arrays, 'mean_face', FACE_SHAPE, low=-limit, high=limit)
    return FaceCode(network, deviations, _origin_of(description), mean_face)


def _origin_of(description: Mapping[str, Any]) -> CodeOrigin:
    trained_on, people = description.get('trained_on'), description.get('people')
    if trained_on not in (WATCHED, OTHERS):
        raise ValueError(f'trained_on must be {WATCHED} or {OTHERS}')
    if not isinstance(people, list) or not all(isinstance(each, str) for each in people):
        raise ValueError('people must be names')
    amounts = [description.get(name) for name in ('seconds', 'caregivers', 'trials')]
    if not all(isinstance(each, int | float) and 0 <= each < np.inf for each in amounts):
        raise ValueError('seconds, caregivers and trials must be numbers from 0')
    seconds, caregivers, trials = (float(str(each)) for each in amounts)
    return CodeOrigin(str(trained_on), seconds, int(caregivers), tuple(people), int(trials))
