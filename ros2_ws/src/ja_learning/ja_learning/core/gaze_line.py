"""A fast learner: where along the line of her gaze is what she means, of all that was seen?

The paper learns from the one object that was fixated, right or wrong. This learner takes *all*
objects seen in the trial as candidates; which one was meant is latent, and never told
(cross-situational learning). Its belief about the displacement c from the caregiver's face is a
mixture along a line, since depth cannot be told from the direction of a gaze:

    p(c | face) = sum_k w_k N(c; r_k u(face), r_k^2 S_u + S_c)

u is a small convolutional network, odd in pan and even in tilt under a mirror (a face is
symmetric, and so is the task); the stretches r_k are fixed, everything else is learned by gradient
steps up the likelihood that *one* of the candidates was meant, or, with a small probability, none
of them. All trials are kept and replayed. Early in life the likelihood is tempered
(deterministic annealing), or the first guesses would confirm themselves.
"""

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import nn

from ja_common.core.config import parameter
from ja_learning.core.network import face_inputs
from ja_learning.core.trial import FACE_SHAPE, Trial

_SCALE_RAD = float(np.radians(40))
_STRETCHES = torch.exp(torch.linspace(np.log(0.35), np.log(2.2), 9))


@dataclass(frozen=True)
class GazeLineConfig:
    """How the fast learner learns."""

    replay_steps: int = parameter(4, 'gradient steps a trial', low=1, high=1000)
    replay_batch: int = parameter(32, 'trials a gradient step', low=1, high=4096)
    replay_memory: int = parameter(5000, 'trials kept for replay', low=1, high=1000000)
    step_size: float = parameter(0.003, 'step size of AdamW', low=1e-6, high=1.0)
    channels: int = parameter(16, 'channels of the first convolution', low=1, high=256)
    none_was_meant: float = parameter(
        0.05, 'prior probability that none of the candidates was meant', low=1e-4, high=0.9
    )
    plausible_within_nats: float = parameter(
        4.5,
        'a seen object is proposed when its log density is this near to that of the best guess; '
        'else the head goes and looks there',
        low=0.0, high=100.0,
    )  # fmt: skip


class GazeLineNetwork(nn.Module):
    """The belief p(c | face); angles in units of 40 degrees."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        wide = 2 * channels
        rows, columns = (-(-size // 8) for size in FACE_SHAPE)
        self.coder = nn.Sequential(
            nn.Conv2d(1, channels, 5, stride=2, padding=2),
            nn.ReLU(),
            nn.Conv2d(channels, wide, 3, stride=2, padding=1),
            nn.ReLU(),
            nn.Conv2d(wide, wide, 3, stride=2, padding=1),
            nn.ReLU(),
            nn.Flatten(),
            nn.Linear(wide * rows * columns, 64),
            nn.ReLU(),
            nn.Linear(64, 2),
        )
        self.stretch_logits = nn.Parameter(torch.zeros(len(_STRETCHES)))
        self.log_gaze_deviation = nn.Parameter(torch.log(torch.tensor([0.10, 0.06])))
        self.log_place_deviation = nn.Parameter(torch.log(torch.tensor([0.05, 0.05])))

    def gaze(self, faces: torch.Tensor) -> torch.Tensor:
        """u, shape (n, 2), of standardised faces (n, 1, 30, 25)."""
        both = self.coder(torch.cat([faces, faces.flip(-1)]))
        seen, mirrored = both.chunk(2)
        return torch.stack(
            [(seen[:, 0] - mirrored[:, 0]) / 2, (seen[:, 1] + mirrored[:, 1]) / 2], dim=1
        )

    def log_density(self, gaze: torch.Tensor, places: torch.Tensor) -> torch.Tensor:
        """log p(c | face), shape (n, m), at places (n, m, 2) for gazes u (n, 2)."""
        stretch = _STRETCHES[:, None]
        variance = stretch**2 * torch.exp(2 * self.log_gaze_deviation) + torch.exp(
            2 * self.log_place_deviation
        )
        off = places[:, :, None] - stretch * gaze[:, None, None]
        parts = -0.5 * (off**2 / variance + torch.log(2 * np.pi * variance)).sum(-1)
        return torch.logsumexp(parts + torch.log_softmax(self.stretch_logits, 0), dim=-1)


class GazeLineLearner:
    """Learns from all that was seen in a trial; proposes what she most probably means."""

    kind = 'gaze_line'

    def __init__(self, config: GazeLineConfig, seed: int) -> None:
        self.config = config
        # The seed's own generator: nobody else's random numbers change this learner.
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self._network = GazeLineNetwork(config.channels)
        self._random = torch.Generator().manual_seed(seed)
        # Proposals come from the running mean of the weights, which is steadier than the last.
        self._mean = copy.deepcopy(self._network).eval()
        self._optimiser = torch.optim.AdamW(
            self._network.parameters(), lr=config.step_size, weight_decay=1e-3
        )
        self._faces: list[torch.Tensor] = []
        self._candidates: list[torch.Tensor] = []
        self._steps = 0
        self.trials = 0
        self.last_error_rad = float('nan')

    def propose(
        self, face: ArrayLike, look: ArrayLike, posture: ArrayLike, candidates: ArrayLike
    ) -> NDArray[np.float64]:
        """Change of posture (2,) [rad] towards what she most probably means.

        `face`: uint8 (30, 25), seen from the posture `look` (2,); `posture` (2,) is where the head
        is now; `candidates` (m, 2) are the directions of the objects seen in this trial. The most
        probable of them is proposed if it is plausible, else the best guess on the line of gaze.
        """
        look = np.asarray(look, float)
        places = np.asarray(candidates, float).reshape(-1, 2) - look
        with torch.no_grad():
            gaze = self._mean.gaze(_picture(face)[None])
            guesses = _STRETCHES[:, None] * gaze
            seen = torch.from_numpy((places / _SCALE_RAD).astype(np.float32))
            density = self._mean.log_density(gaze, torch.cat([guesses, seen])[None])[0].numpy()
        of_guesses, of_seen = density[: len(guesses)], density[len(guesses) :]
        best = int(np.argmax(of_guesses))
        aim = guesses[best].numpy().astype(float) * _SCALE_RAD
        if len(of_seen) and of_seen.max() > of_guesses[best] - self.config.plausible_within_nats:
            aim = places[int(np.argmax(of_seen))]
        return look + aim - np.asarray(posture, float)

    def belief(
        self, face: ArrayLike, look: ArrayLike, rng: np.random.Generator, count: int
    ) -> NDArray[np.float64]:
        """Directions (count, 2) [rad] drawn from the belief about what she means."""
        with torch.no_grad():
            gaze = self._mean.gaze(_picture(face)[None])[0].numpy()
            shares = torch.softmax(self._mean.stretch_logits, 0).numpy().astype(float)
            deviations = [
                torch.exp(logs).numpy()
                for logs in (self._mean.log_gaze_deviation, self._mean.log_place_deviation)
            ]
        stretch = rng.choice(_STRETCHES.numpy(), (count, 1), p=shares / shares.sum())
        off = stretch * deviations[0] * rng.standard_normal((count, 2))
        places = stretch * gaze + off + deviations[1] * rng.standard_normal((count, 2))
        return np.asarray(look, float) + places * _SCALE_RAD

    def log_density(
        self, face: ArrayLike, look: ArrayLike, directions: ArrayLike
    ) -> NDArray[np.float64]:
        """log p of directions (m, 2) [rad], in units of 40 degrees squared, shape (m,)."""
        places = (np.asarray(directions, float) - np.asarray(look, float)) / _SCALE_RAD
        with torch.no_grad():
            gaze = self._mean.gaze(_picture(face)[None])
            seen = torch.from_numpy(places.astype(np.float32))
            return self._mean.log_density(gaze, seen[None])[0].numpy().astype(float)

    def learn(self, trial: Trial) -> None:
        """Remember a trial, and replay some of all that were lived."""
        self.trials += 1
        if not len(trial.candidates):
            return
        places = (trial.candidates - trial.postures[0]) / _SCALE_RAD
        self._faces.append(_picture(trial.face))
        self._candidates.append(torch.from_numpy(places.astype(np.float32)))
        if len(self._faces) > self.config.replay_memory:
            del self._faces[0], self._candidates[0]
        for _ in range(self.config.replay_steps):
            self._step()

    def _step(self) -> None:
        known = len(self._faces)
        count = min(self.config.replay_batch, known)
        chosen = torch.randint(known, (count,), generator=self._random)
        chosen[0] = known - 1  # the newest is always among them
        faces = torch.stack([self._faces[i] for i in chosen])
        places = nn.utils.rnn.pad_sequence(
            [self._candidates[i] for i in chosen], batch_first=True, padding_value=torch.nan
        )
        loss = self._loss(self._varied(faces), places)
        self._optimiser.zero_grad()
        loss.backward()
        self._optimiser.step()
        self._steps += 1
        keep = min(0.995, 1 - 1 / (self._steps / 10 + 1))
        with torch.no_grad():
            for mean, now in zip(self._mean.parameters(), self._network.parameters(), strict=True):
                mean.lerp_(now, 1 - keep)

    def _varied(self, faces: torch.Tensor) -> torch.Tensor:
        """The faces a little otherwise, as another look would show them: noise, a pixel aside."""
        noise = 0.1 * torch.randn(faces.shape, generator=self._random)
        rows, columns = torch.randint(-1, 2, (2,), generator=self._random).tolist()
        return torch.roll(faces + noise, (rows, columns), dims=(2, 3))

    def _loss(self, faces: torch.Tensor, places: torch.Tensor) -> torch.Tensor:
        """Minus the tempered log likelihood that one of the candidates, or none, was meant."""
        there = ~torch.isnan(places[..., 0])
        counts = there.sum(1, keepdim=True)
        gaze = self._network.gaze(faces)
        density = self._network.log_density(gaze, torch.nan_to_num(places))
        coldness = self._coldness()
        none = self.config.none_was_meant
        one = (coldness * density + np.log1p(-none) - torch.log(counts)).masked_fill(
            ~there, -torch.inf
        )
        # If none was meant, the place is anywhere in a field of 80 x 30 degrees: 2 x 0.75 units.
        elsewhere = torch.full((len(faces), 1), coldness * np.log(none / 1.5))
        return -torch.logsumexp(torch.cat([one, elsewhere], dim=1), dim=1).mean() / coldness

    def _coldness(self) -> float:
        """From 0.1, where all candidates count nearly alike, to 1, the likelihood itself.

        Takes twice as many trials as there are pairs of candidates: the more there are, the later
        one may be told from another.
        """
        typical = float(np.mean([len(places) for places in self._candidates[-50:]]))
        return min(1.0, 0.1 + 0.9 * self.trials / (2 * typical**2))

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything that learning has changed, the remembered trials too, as named arrays."""
        arrays = {f'network.{k}': v.numpy().copy() for k, v in self._network.state_dict().items()}
        arrays |= {f'mean.{k}': v.numpy().copy() for k, v in self._mean.state_dict().items()}
        for name, p in self._network.named_parameters():
            for key, value in self._optimiser.state.get(p, {}).items():
                arrays[f'optimiser.{name}.{key}'] = value.numpy().copy()
        arrays['random'] = self._random.get_state().numpy()
        arrays['steps'], arrays['trials'] = np.array(self._steps), np.array(self.trials)
        arrays['faces'] = np.array([f.numpy() for f in self._faces], np.float32)
        arrays['candidate_counts'] = np.array([len(c) for c in self._candidates], int)
        arrays['candidates'] = np.concatenate(
            [np.empty((0, 2), np.float32), *(c.numpy() for c in self._candidates)]
        )
        return arrays

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take up the state of `state()`.

        Raises ValueError, and changes nothing, if it is another learner's or not finite.
        """
        for name, array in arrays.items():
            if array.dtype.kind == 'f' and not np.isfinite(array).all():
                raise ValueError(f'{name} holds numbers that are not finite')
        try:
            networks = [_loaded(self._network, arrays, p) for p in ('network.', 'mean.')]
            counts, places = arrays['candidate_counts'], arrays['candidates']
            faces = list(torch.from_numpy(arrays['faces'].copy()))
            steps, trials = int(arrays['steps']), int(arrays['trials'])
            random = torch.Generator()
            random.set_state(torch.from_numpy(arrays['random'].copy()))
        except (KeyError, RuntimeError, TypeError, IndexError) as error:
            raise ValueError(f'not the state of this learner: {error}') from None
        if len(faces) != len(counts) or counts.sum() != len(places):
            raise ValueError(
                f'{len(faces)} faces and {len(places)} candidates do not fit the counts {counts}'
            )
        split = np.split(places, np.cumsum(counts)[:-1]) if len(counts) else []
        self._random = random
        self._network.load_state_dict(networks[0])
        self._mean.load_state_dict(networks[1])
        for name, p in self._network.named_parameters():
            prefix = f'optimiser.{name}.'
            kept = {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
            if kept:
                self._optimiser.state[p] = {
                    k: torch.from_numpy(np.array(v)) for k, v in kept.items()
                }
        self._faces = faces
        self._candidates = [torch.from_numpy(part.copy()) for part in split]
        self._steps, self.trials = steps, trials


def _picture(face: ArrayLike) -> torch.Tensor:
    pixels = face_inputs(face, 'standardised').reshape(1, *FACE_SHAPE)
    return torch.from_numpy(pixels.astype(np.float32))


def _loaded(
    like: nn.Module, arrays: dict[str, NDArray[Any]], prefix: str
) -> dict[str, torch.Tensor]:
    found = {}
    for name, tensor in like.state_dict().items():
        array = arrays[prefix + name]
        if array.shape != tuple(tensor.shape):
            raise ValueError(
                f'{prefix}{name} must have shape {tuple(tensor.shape)}, found {array.shape}'
            )
        found[name] = torch.from_numpy(array.copy())
    return found
