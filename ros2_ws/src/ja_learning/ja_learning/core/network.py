"""The learning module of the paper: a 752-7-2 network that learns online by back-propagation."""

import copy
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from ja_learning.core.checkpoint_arrays import count, numbers
from ja_learning.core.evidence import Evidence
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.trial import FACE_SHAPE, Look, Trial

INPUTS = FACE_SHAPE[0] * FACE_SHAPE[1] + 2


class ThreeLayerNetwork:
    """The network from face image and posture to change of posture (section 2.2.4).

    It has 30 x 25 + 2, 7 and 2 units. Hidden units are tanh, outputs linear. One step down the
    squared error a pair.
    """

    kind = 'paper'

    def __init__(self, config: NetworkConfig, seed: int) -> None:
        """Draw the initial weights from this seed."""
        self.config = config
        generator = torch.Generator().manual_seed(seed)

        def weights(*shape: int) -> torch.nn.Parameter:
            span = 2 * torch.rand(shape, generator=generator) - 1
            return torch.nn.Parameter(config.initial_weight * span)

        self._parameters = {
            'hidden_weights': weights(config.hidden, INPUTS),
            'hidden_biases': weights(config.hidden),
            'output_weights': weights(2, config.hidden),
            'output_biases': weights(2),
        }
        self._optimiser = torch.optim.SGD(
            self._parameters.values(), lr=config.learning_rate, momentum=config.momentum
        )
        self._evidence = Evidence()
        self.trials = 0
        self.last_error_rad = float('nan')

    def predict(self, face: ArrayLike, posture: ArrayLike) -> NDArray[np.float64]:
        """Return changes of posture (..., 2) [rad] for faces (..., 30, 25), postures (..., 2)."""
        with torch.no_grad():
            output = self._forward(self._inputs(np.asarray(face), np.asarray(posture, float)))
        return output.numpy().astype(float) * self.config.angle_scale_rad

    def propose(
        self,
        look: Look,
        posture: ArrayLike,
        candidates: ArrayLike,
        ranges: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """Return the same as `predict`: the paper's learner does not use the candidates."""
        return self.predict(look.face, posture)

    def belief(self, look: Look, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Draw directions (count, 2) [rad] about the one that it proposes from the look."""
        off = self.config.believed_within_rad * rng.standard_normal((count, 2))
        # A head that attends to a face is turned towards it.
        return look.face_at + self.predict(look.face, look.face_at) + off

    def log_density(
        self, faces: ArrayLike, face_at: ArrayLike, directions: ArrayLike
    ) -> NDArray[np.float64]:
        """Return log p, (n, m) [of 1 / rad^2], of directions (m, 2) given faces (n, 30, 25)."""
        face_at, variance = np.asarray(face_at, float), self.config.believed_within_rad**2
        postures = np.broadcast_to(face_at, (len(np.asarray(faces)), 2))
        proposed = face_at + self.predict(faces, postures)
        off = np.asarray(directions, float).reshape(-1, 2) - proposed[:, None]
        return -0.5 * (off**2).sum(axis=-1) / variance - np.log(2 * np.pi * variance)

    @property
    def log_evidence(self) -> float:
        """Return the evidence [nats] that the face informs this learner, as in `Predictor`."""
        return float(self._evidence.nats[0])

    def snapshot(self) -> 'ThreeLayerNetwork':
        """Copy what is believed now."""
        taken = copy.copy(self)
        taken._parameters = {
            name: torch.nn.Parameter(p.detach().clone()) for name, p in self._parameters.items()
        }
        taken._evidence = copy.deepcopy(self._evidence)
        return taken

    def update(self, trial: Trial) -> None:
        """Back-propagate the pairs of one trial, one step a pair, in the order they came.

        A trial that was given up changes nothing.
        """
        if trial.fixation is None:
            return
        self._weigh(trial)
        chosen = slice(-1, None) if self.config.pairs == 'last' else slice(None)
        inputs = self._inputs(trial.face, trial.postures[chosen])
        wanted = torch.from_numpy(
            (trial.displacements()[chosen] / self.config.angle_scale_rad).astype(np.float32)
        )
        for one_input, one_wanted in zip(inputs, wanted, strict=True):
            self._optimiser.zero_grad()
            error = self._forward(one_input) - one_wanted
            (0.5 * error.square().sum()).backward()
            self._optimiser.step()
        self.trials += 1
        self.last_error_rad = float(error.detach().norm()) * self.config.angle_scale_rad

    def _weigh(self, trial: Trial) -> None:
        seen = trial.candidates[: trial.seen_before_shift]
        if len(seen):
            self._evidence.weigh_trial(
                trial.face,
                lambda faces: np.logaddexp.reduce(
                    self.log_density(faces, trial.face_at, seen), axis=1
                )[None],
            )

    def state(self) -> dict[str, NDArray[Any]]:
        """Return everything that learning has changed, as named arrays."""
        arrays = {name: p.detach().numpy().copy() for name, p in self._parameters.items()}
        for name, p in self._parameters.items():
            momentum = self._optimiser.state[p].get('momentum_buffer')
            if momentum is not None:
                arrays[f'momentum_{name}'] = momentum.numpy().copy()
        arrays['trials'] = np.array(self.trials)
        return arrays | self._evidence.state()

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take the state of `state()`.

        Raises ValueError, and changes nothing, if it is not one of this network.
        """
        shapes = {name: tuple(p.shape) for name, p in self._parameters.items()}
        weights = {name: numbers(arrays, name, shape) for name, shape in shapes.items()}
        momenta = {
            name: torch.from_numpy(numbers(arrays, f'momentum_{name}', shape))
            for name, shape in shapes.items()
            if f'momentum_{name}' in arrays
        }
        trials, evidence = count(arrays, 'trials'), Evidence()
        evidence.restore(arrays)
        for name, p in self._parameters.items():
            p.data.copy_(torch.from_numpy(weights[name]))
            self._optimiser.state[p]['momentum_buffer'] = momenta.get(name)
        self.trials, self._evidence = trials, evidence

    def _forward(self, inputs: torch.Tensor) -> torch.Tensor:
        p = self._parameters
        hidden = torch.tanh(
            torch.nn.functional.linear(inputs, p['hidden_weights'], p['hidden_biases'])
        )
        return torch.nn.functional.linear(hidden, p['output_weights'], p['output_biases'])

    def _inputs(self, face: NDArray[Any], postures: NDArray[np.float64]) -> torch.Tensor:
        pixels = face_inputs(face, self.config.face_scaling)
        angles = postures / self.config.angle_scale_rad * self.config.posture_input
        pixels = np.broadcast_to(pixels, (*angles.shape[:-1], pixels.shape[-1]))
        return torch.from_numpy(np.concatenate([pixels, angles], axis=-1).astype(np.float32))


def face_inputs(faces: ArrayLike, scaling: str) -> NDArray[np.float64]:
    """Return faces, uint8 (..., 30, 25), as inputs (..., 750); `scaling`: see `NetworkConfig`."""
    faces = np.asarray(faces)
    pixels = faces.reshape(*faces.shape[:-2], -1) / 255.0 - 0.5
    if scaling == 'standardised':
        spread = np.maximum(pixels.std(axis=-1, keepdims=True), 1e-3)
        pixels = (pixels - pixels.mean(axis=-1, keepdims=True)) / spread
    return pixels
