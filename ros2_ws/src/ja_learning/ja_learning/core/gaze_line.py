"""A fast learner: which of all objects that were seen stands on the line of her gaze?

The paper learns from the one object that was fixated, right or wrong. This learner takes *all*
objects seen in the trial as candidates. Which one is the attended object is latent, and no label
gives it (cross-situational learning). Gradient steps go up the likelihood that *one* of the
candidates is the attended object, or, with a small probability, none of them. The likelihood of a
candidate is relative to places that were seen in other trials, the negatives (noise-contrastive,
as InfoNCE by van den Oord et al. 2018): so nothing is learned from where objects are seen in any
case. Trials are kept and replayed.

At first the likelihood is tempered (deterministic annealing), or the first guesses would confirm
themselves. The best annealing rate is unknown. So several members learn side by side, from slow to
fast annealing, and are weighed by the evidence that each has for itself (`evidence`). One that
confirmed its own guesses - the mirrored gaze is the classical error - has evidence against it, and
is overwritten by the best member. If the evidence turns against all of them, the world has changed
(a new caregiver, a camera the other way round). Then the trials before the change are forgotten,
and half of the members are re-initialised.
"""

import copy
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from ja_learning.core.checkpoint_arrays import count, counts, numbers
from ja_learning.core.contrast_memory import CONTRAST, ContrastMemory
from ja_learning.core.eigenface_posterior import GUESS_BEGINS, EigenfacePosterior
from ja_learning.core.evidence import ChangeAlarm, Evidence
from ja_learning.core.face_code import OTHERS, WATCHED, FaceCode, load_face_code
from ja_learning.core.face_warps import warped
from ja_learning.core.gaze_line_belief import AnswersFromSnapshot, GazeLineBelief
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.gaze_line_network import GazeLineNetwork, give_member
from ja_learning.core.gaze_line_pass import GazeLinePass
from ja_learning.core.gaze_line_places import seen_places
from ja_learning.core.gaze_table import level_mixture
from ja_learning.core.mean_face import contrast
from ja_learning.core.trial import FACE_SHAPE, Look, MeanFace, Trial

# Annealing ends after so many trials for every pair of candidates: the more candidates there are,
# the more trials it takes to tell one from another. A small number is a fast annealing rate.
_FASTEST_ANNEALING, _SLOWEST_ANNEALING = 0.25, 2.0
_INITIAL_INVERSE_TEMPERATURE = 0.1
# AdamW counts its steps in 32 bits of a float; beyond this it stands still.
_MOST_STEPS = 2.0**24
# With how many negatives the places of a trial are compared: in each training step, drawn again;
# to weigh a trial, once, where the effect of the draw would be taken for evidence.
_TRAINING_NEGATIVES, _WEIGHING_NEGATIVES = 64, 256
# Augmentation of a replayed face: its size (a share), as another look would show it.
_AUGMENTED_SIZE = 0.1
# So far soft labels of the first guess are trusted, which may be wrong.
_GUESSED = 0.85
# The guess about old trials becomes better with the new ones.
_GUESSED_AGAIN_AT = (36, 72, 150, 300)
_FEWEST_OTHERS = 4
# By so much the first guess is more probable than an untrained network before any evidence.
_BEFORE_EVIDENCE_NATS, _UNTRAINED_TRIALS = 6.0, 60
# Of the evidence from another person so much is kept: enough for the gate to stay open.
_OF_ANOTHER_NATS = 5.0
_COMPARED_EVERY_TRIALS = 10
_REPLACED_BEHIND_NATS = 15.0
_CLEAR_NATS = 10.0
_WRONG_NATS = 8.0


class GazeLineLearner(AnswersFromSnapshot):
    """A learner from all that was seen in a trial, with no use for the fixation."""

    kind = 'gaze_line'

    def __init__(self, config: GazeLineConfig, seed: int) -> None:
        """Draw the initial weights from this seed, and compile what answers."""
        self.config = config
        self._network = _initial_network(config, seed)
        self._random = torch.Generator().manual_seed(seed)
        # Proposals come from the running mean of the weights, which is steadier than the last.
        self._mean = copy.deepcopy(self._network).requires_grad_(False)
        self._optimiser = _optimiser(self._network, config)
        self._annealing = _annealing(config)
        # How many trials were remembered when each member started.
        self._began = np.zeros(config.members, int)
        self._memory = ContrastMemory(config.replay_memory)
        self._seed = seed
        self._code = _face_code(config)
        self._first_guess = self._start_first_guess()
        # Of each candidate of the trials remembered, what the first guess makes of it.
        self._shares: list[NDArray[np.float32]] = []
        # Of each member, of the first guess if there is one, and of their mixture.
        self._evidence = self._no_evidence()
        self._alarm = ChangeAlarm()
        self._steps = 0
        self._belief: GazeLineBelief | None = None
        self.trials = 0
        self.last_error_rad = float('nan')
        # Otherwise the first proposal would wait for the compiler.
        nothing = Look(np.zeros(FACE_SHAPE, np.uint8), np.zeros(2))
        self.propose(nothing, np.zeros(2), np.empty((0, 2)))

    @property
    def log_evidence(self) -> float:
        """Return the evidence [nats] that the face informs this learner, as in `Predictor`."""
        nats = self._evidence.nats
        if self._first_guess is None:
            return float(nats[-1])
        # A mean of e-values is one (`evidence`). The mixture is held down by what it believed at
        # first; the first guess may begin at any of its fits, and has bet nothing until then.
        guess = np.logaddexp(nats[-2], np.log(GUESS_BEGINS - 1)) - np.log(GUESS_BEGINS)
        return float(np.logaddexp(nats[-1], guess) - np.log(2))

    @property
    def mean_face(self) -> MeanFace | None:
        """Return the mean face of the person of whom it has learned last, or whom it watched."""
        watched = None if self._code is None else self._code.mean_face
        if self._memory.mean_face is None and watched is not None:
            return MeanFace(zlib.crc32(watched.tobytes()), watched)
        return self._memory.mean_face

    def snapshot(self) -> GazeLineBelief:
        """Return what is believed now, made when first asked for; no later update changes it."""
        if self._belief is None:
            self._belief = self._mixed_belief()
        return self._belief

    def update(self, trial: Trial) -> None:
        """Weigh a trial by what is believed, remember it, and replay some of those remembered."""
        self.trials += 1
        if not len(trial.candidates):
            return
        self._belief = None
        places = seen_places(trial.look, trial.candidates, trial.ranges).astype(np.float32)
        changed = False
        if trial.seen_before_shift:
            changed = self._weigh(contrast(trial.look), places[: trial.seen_before_shift])
        self._memory.remember(trial, places)
        if self._memory.of_present_person == 1:
            self._meet_another_person()
        if self._first_guess is not None:
            fitted = self._first_guess.add_newest()
            if fitted:
                # It is another guess now: what spoke against the one before does not concern it.
                self._evidence.nats[-2] = max(0.0, float(self._evidence.nats[-2]))
            again = fitted or self._first_guess.trials in _GUESSED_AGAIN_AT
            guessed = min(self._first_guess.trials, len(self._memory)) if again else 1
            self._guess_shares(guessed, known=guessed - 1)
        if changed:
            self._reinitialise(self._alarm.doubtful_trials)
        inverse_temperature = self._inverse_temperature()
        for _ in range(self.config.replay_steps):
            self._step(inverse_temperature)
        if self.trials % _COMPARED_EVERY_TRIALS == 0:
            self._replace_worst_member()

    def _meet_another_person(self) -> None:
        """Keep what is known, but let it show anew what it is worth with this person."""
        np.minimum(self._evidence.nats, _OF_ANOTHER_NATS, out=self._evidence.nats)
        if self._first_guess is not None:  # her face has other axes
            self._first_guess = EigenfacePosterior(self._memory, self._seed, 0, self._code)
            self._evidence.nats[-2] = 0.0

    def _start_first_guess(self) -> EigenfacePosterior | None:
        """Return a first guess from the trials with the present person, if there is to be one."""
        if self.config.first_guess == 'none':
            return None
        present = self._memory.of_present_person
        return EigenfacePosterior(self._memory, self._seed, present, self._code)

    def _no_evidence(self) -> Evidence:
        if self.config.first_guess == 'none':
            return Evidence(self.config.members + 1, CONTRAST)
        # The first guess knows something long before fifteen trials.
        return Evidence(self.config.members + 2, CONTRAST, _FEWEST_OTHERS)

    def _mixed_belief(self) -> GazeLineBelief:
        """Return the belief of all members, and of the first guess if there is one."""
        answer, mixture = GazeLinePass(self._mean), self._mean.mixture().as_numpy()
        log_weights, guess = self._log_weights(), self._first_guess
        gaze_of: Callable[[NDArray[Any]], NDArray[np.float64]] = answer
        surest = int(np.argmax(log_weights))
        if guess is not None:
            members = log_weights[: self.config.members]
            if guess.is_known:
                maps, features = guess.sample(), guess.features

                def both(faces: NDArray[Any]) -> NDArray[np.float64]:
                    return np.concatenate([answer(faces), maps.gazes(features(faces))])

                gaze_of = both

                mixture = mixture.joined(level_mixture(maps.levels))
                count = len(maps.levels)
                log_weights = np.append(members, np.full(count, log_weights[-1] - np.log(count)))
            else:
                log_weights = members - np.logaddexp.reduce(members)
                surest = int(np.argmax(members))
        return GazeLineBelief(
            contrast,
            gaze_of,
            mixture,
            log_weights,
            self.log_evidence,
            self.config.top_down,
            self.config.plausible_within_nats,
            # The weight of the first guess is shared by its maps, of which the likeliest is first.
            surest,
            # Untrained networks are sure of nothing in particular.
            calibrated=guess is not None and guess.is_known,
        )

    def _guess_shares(self, count: int, known: int) -> None:
        """Note what the first guess makes of the candidates of so many newest trials.

        `known`: of how many of them something is noted already.
        """
        guess = self._first_guess
        assert guess is not None
        faces, places = self._memory.trials_at(np.arange(count)[::-1])
        shares = [
            _candidate_shares(guess, face, seen[~np.isnan(seen[:, 0])])
            for face, seen in zip(faces, places, strict=True)
        ]
        earlier = self._shares[: len(self._shares) - known]
        self._shares = [*earlier, *shares][-len(self._memory) :]

    def _log_weights(self) -> NDArray[np.float64]:
        nats = self._evidence.nats[:-1].copy()
        if self._first_guess is not None:
            nats[-1] += max(0.0, _BEFORE_EVIDENCE_NATS * (1 - self.trials / _UNTRAINED_TRIALS))
        return nats - np.logaddexp.reduce(nats)

    def _weigh(self, face: NDArray[np.float32], places: NDArray[np.float32]) -> bool:
        """Weigh what was seen; return whether it is clear by now that the world has changed."""

        def log_probability(faces: NDArray[np.float32]) -> NDArray[np.float64]:
            with torch.no_grad():
                gaze = self._mean.gaze(torch.from_numpy(faces[:, None]))
                seen = torch.from_numpy(places)[None, None]
                negatives = self._draw_negatives(_WEIGHING_NEGATIVES)
                ratio = self._mean.log_ratio(gaze, seen, negatives)
            # That one of them is the attended object; which one is not known.
            of_members = torch.logsumexp(ratio, dim=-1).numpy().astype(float)
            if self._first_guess is not None:
                guessed = _first_guess_ratio(self._first_guess, faces, places)
                of_members = np.vstack([of_members, guessed])
            mixed = np.logaddexp.reduce(of_members + self._log_weights()[:, None], axis=0)
            return np.concatenate([of_members, mixed[None]])

        knew = self.log_evidence > _CLEAR_NATS
        log_ratio = float(self._evidence.weigh_trial(face, log_probability)[-1])
        return self._alarm.add_log_ratio(log_ratio, knew)

    def _step(self, inverse_temperature: torch.Tensor) -> None:
        members, known = self.config.members, len(self._memory)
        count = min(self.config.replay_batch, known)
        # Each member replays its own choice, so that they differ; the newest trial always.
        ages = torch.randint(known, (count, members), generator=self._random).numpy()
        # Of a new person there are few trials yet: every second one is hers.
        ages[::2] %= self._memory.of_present_person
        ages[0] = 0
        faces, places = self._memory.trials_at(ages)
        loss = self._loss(
            # Without this every member overfits the remembered faces, and the evidence falls.
            warped(torch.from_numpy(faces), _AUGMENTED_SIZE, self._random),
            torch.from_numpy(places).transpose(0, 1),
            self._log_prior(ages, places),
            inverse_temperature,
        )
        self._optimiser.zero_grad()
        loss.backward()
        self._hold_origins(inverse_temperature)
        self._optimiser.step()
        self._steps += 1
        keep = min(0.995, 1 - 1 / (self._steps / 10 + 1))
        with torch.no_grad():
            now = list(self._network.parameters())
            torch._foreach_lerp_(list(self._mean.parameters()), now, 1 - keep)

    def _hold_origins(self, inverse_temperature: torch.Tensor) -> None:
        """Hold the origins of lines during annealing: they would follow wrong guesses."""
        slope = self._network.origin_tilt.grad
        if slope is not None:
            slope[inverse_temperature < 1.0] = 0.0

    def _draw_negatives(self, count: int) -> torch.Tensor:
        """Draw places (members, count, 8) that were seen in any of the trials remembered."""
        drawn = (count, self.config.members)
        ages = torch.randint(len(self._memory), drawn, generator=self._random)
        which = torch.rand(drawn, generator=self._random)
        places = self._memory.places_at(ages.numpy(), which.numpy())
        return torch.from_numpy(places).transpose(0, 1)

    def _log_prior(self, ages: NDArray[np.int64], places: NDArray[np.float32]) -> torch.Tensor:
        """Return the log probability of each candidate before the members see the face.

        All alike, or the soft labels of the first guess; of shape (members, n, 1 or m).
        """
        if self._first_guess is None:
            counts = (~np.isnan(places[..., 0])).sum(-1, keepdims=True)
            return -torch.log(torch.from_numpy(counts)).transpose(0, 1)
        shares: NDArray[np.float32] = np.zeros(places.shape[:-1], np.float32)
        for row, age in zip(shares.reshape(-1, shares.shape[-1]), ages.ravel(), strict=True):
            of_trial = self._shares[-1 - age]
            row[: len(of_trial)] = of_trial
        return torch.log(torch.from_numpy(shares).transpose(0, 1))

    def _loss(
        self,
        faces: torch.Tensor,
        places: torch.Tensor,
        log_prior: torch.Tensor,
        inverse_temperature: torch.Tensor,
    ) -> torch.Tensor:
        """Return minus the tempered log likelihood of one attended object, or none."""
        inverse_temperature = inverse_temperature[:, None, None]
        negatives = self._draw_negatives(_TRAINING_NEGATIVES)
        ratio = self._network.log_ratio(self._network.gaze(faces), places, negatives)
        none = self.config.none_was_meant
        one = inverse_temperature * ratio + np.log1p(-none) + log_prior
        # Without an attended object, places are distributed as the negatives: a ratio of 1.
        nothing = (inverse_temperature * np.log(none)).expand(-1, len(faces), -1)
        tempered = torch.cat([one, nothing], dim=-1)
        # A sum over members, as none of them depends on another.
        return -(torch.logsumexp(tempered, dim=-1) / inverse_temperature[..., 0]).mean(dim=1).sum()

    def _inverse_temperature(self) -> torch.Tensor:
        """Return that of each member, from 0.1, where all candidates count nearly alike, to 1."""
        typical = float(np.mean(self._memory.counts(50)))
        trials = np.maximum(len(self._memory) - self._began, 0)
        annealed = trials / (self._annealing * max(typical, 1.0) ** 2)
        inverse_temperature = np.minimum(
            1.0, _INITIAL_INVERSE_TEMPERATURE + (1 - _INITIAL_INVERSE_TEMPERATURE) * annealed
        )
        return torch.from_numpy(inverse_temperature.astype(np.float32))

    def _reinitialise(self, newest: int) -> None:
        """Keep only so many newest trials, and re-initialise every second member."""
        self._memory.keep_newest(newest)
        self._alarm.reset()
        self._evidence.nats[:] = 0.0
        members = self.config.members
        self._reinitialise_members(list(range(0, members, 2)))
        self._annealing = _annealing(self.config)
        self._began[:] = 0
        self._first_guess = self._start_first_guess()
        if self._first_guess is not None:
            self._guess_shares(self._first_guess.trials, known=self._first_guess.trials)
        self._optimiser.state.clear()
        self._steps = 0

    def _reinitialise_members(self, members: list[int]) -> None:
        """Give these members initial weights."""
        seed = int(torch.randint(2**62, (), generator=self._random))
        fresh = _initial_network(self.config, seed)
        with torch.no_grad():
            for network in (self._network, self._mean):
                for old, new in zip(network.parameters(), fresh.parameters(), strict=True):
                    parts = old.reshape(self.config.members, -1)
                    parts[members] = new.reshape(self.config.members, -1)[members]
            for kept in self._optimiser.state.values():
                for moments in (kept['exp_avg'], kept['exp_avg_sq']):
                    moments.reshape(self.config.members, -1)[members] = 0.0

    def _replace_worst_member(self) -> None:
        """Overwrite the worst member by the best, if the evidence between them is clear.

        Where all have evidence against them there is no best: the worst is re-initialised, now
        that more is remembered, with the slowest annealing. If they knew something before, the
        world may have changed, which the alarm decides.
        """
        nats = self._evidence.nats[: self.config.members]
        best, worst = int(np.argmax(nats)), int(np.argmin(nats))
        if nats[best] < 0:
            if nats[worst] < -_WRONG_NATS and self._alarm.doubt == 0.0:
                self._reinitialise_members([worst])
                nats[worst] = 0.0
                self._annealing[worst] = _SLOWEST_ANNEALING
                self._began[worst] = len(self._memory)
            return
        if nats[best] - nats[worst] < _REPLACED_BEHIND_NATS:
            return
        with torch.no_grad():
            for network in (self._network, self._mean):
                for parameter_ in network.parameters():
                    give_member(parameter_, self.config.members, best, worst)
            for kept in self._optimiser.state.values():
                for moments in (kept['exp_avg'], kept['exp_avg_sq']):
                    give_member(moments, self.config.members, best, worst)
        nats[worst] = nats[best]
        self._annealing[worst] = self._annealing[best]
        self._began[worst] = self._began[best]

    def state(self) -> dict[str, NDArray[Any]]:
        """Return all that learning has changed, the remembered trials too, as named arrays."""
        arrays = {f'network.{k}': v.numpy().copy() for k, v in self._network.state_dict().items()}
        arrays |= {f'mean.{k}': v.numpy().copy() for k, v in self._mean.state_dict().items()}
        for name, p in self._network.named_parameters():
            for key, value in self._optimiser.state.get(p, {}).items():
                arrays[f'optimiser.{name}.{key}'] = value.numpy().copy()
        arrays['random'] = self._random.get_state().numpy()
        arrays['steps'], arrays['trials'] = np.array(self._steps), np.array(self.trials)
        arrays['annealing'], arrays['began'] = self._annealing.copy(), self._began.copy()
        arrays['doubt'] = np.array(self._alarm.doubt)
        arrays['doubtful_trials'] = np.array(self._alarm.doubtful_trials)
        if self._first_guess is not None:
            arrays |= self._first_guess.state()
            arrays['seed'] = np.array(self._seed)
            arrays['candidate_shares'] = np.concatenate([np.zeros(0, np.float32), *self._shares])
        return arrays | self._memory.state() | self._evidence.state()

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Take the state of `state()`.

        Raises ValueError, and changes nothing, if it is not one of this learner.
        """
        members = self.config.members
        networks = [_loaded(self._network, arrays, p) for p in ('network.', 'mean.')]
        moments = {
            p: _loaded_moments(arrays, f'optimiser.{name}.', tuple(p.shape))
            for name, p in self._network.named_parameters()
        }
        memory = ContrastMemory.restored(arrays, self.config.replay_memory)
        evidence = self._no_evidence()
        evidence.restore(arrays)
        seed, guess, shares = self._seed, self._first_guess, self._shares
        if guess is not None:
            seed = count(arrays, 'seed')
            guess = EigenfacePosterior.restored(arrays, memory, seed, self._code)
            seen_in = counts(arrays, 'candidate_counts')
            flat = numbers(arrays, 'candidate_shares', (int(seen_in.sum()),), low=0.0, high=1.0)
            shares = np.split(flat, np.cumsum(seen_in))[:-1]
        steps, trials = count(arrays, 'steps'), count(arrays, 'trials')
        doubt = float(numbers(arrays, 'doubt', (), np.float64, low=0.0))
        doubtful = count(arrays, 'doubtful_trials')
        began = counts(arrays, 'began', (members,))
        annealing = numbers(arrays, 'annealing', (members,), np.float64, low=0.01)
        random = torch.Generator()
        state = numbers(arrays, 'random', tuple(random.get_state().shape), np.uint8)
        try:
            random.set_state(torch.from_numpy(state))
        except RuntimeError as error:
            raise ValueError(f'random is no state of a generator: {error}') from None
        self._random, self._memory, self._evidence = random, memory, evidence
        self._seed, self._first_guess, self._shares = seed, guess, shares
        self._network.load_state_dict(networks[0])
        self._mean.load_state_dict(networks[1])
        self._optimiser.state.clear()
        self._optimiser.state.update({p: kept for p, kept in moments.items() if kept})
        self._steps, self.trials, self._belief = steps, trials, None
        self._annealing, self._began = annealing, began
        self._alarm.doubt, self._alarm.doubtful_trials = doubt, doubtful


def _face_code(config: GazeLineConfig) -> FaceCode | None:
    """Return the face code that the first guess reads with, if it is one."""
    if config.first_guess not in (WATCHED, OTHERS):
        return None
    return load_face_code(Path(config.face_code), config.first_guess)


def _initial_network(config: GazeLineConfig, seed: int) -> GazeLineNetwork:
    # A generator of its own: no other random numbers change this learner.
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return GazeLineNetwork(config.members, config.channels)


def _optimiser(network: GazeLineNetwork, config: GazeLineConfig) -> torch.optim.AdamW:
    # A trial constrains the gaze far less than its picture would allow to fit: without decay the
    # weights fit noise. The numbers of the belief have units: they must not decay to zero.
    decaying = network.weights()
    others = [p for p in network.parameters() if not any(p is weight for weight in decaying)]
    groups = [
        {'params': decaying, 'weight_decay': config.weight_decay},
        {'params': others, 'weight_decay': 0.0},
    ]
    return torch.optim.AdamW(groups, lr=config.step_size, fused=True)


def _annealing(config: GazeLineConfig) -> NDArray[np.float64]:
    if config.first_guess != 'none':
        # Its soft labels replace the slow search for the first ones.
        return np.full(config.members, _FASTEST_ANNEALING)
    return np.geomspace(_FASTEST_ANNEALING, _SLOWEST_ANNEALING, config.members)


def _first_guess_ratio(
    guess: EigenfacePosterior, faces: NDArray[np.float32], places: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Return the log ratio (n,) of the first guess on the scale of the members' ones."""
    if not guess.is_known:
        return np.full(len(faces), np.log(len(places)))
    return guess.log_ratios(faces, places) + np.log(len(places))


def _candidate_shares(
    guess: EigenfacePosterior, face: NDArray[np.float32], places: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return how probable the first guess makes each of places (m, 8) the attended one, (m,)."""
    alike = 1 / max(len(places), 1)
    if not guess.is_known:
        return np.full(len(places), alike, np.float32)
    each = guess.log_ratios_of_places(face, places)
    shares = np.exp(each - each.max(initial=-np.inf))
    shares /= shares.sum()
    return (_GUESSED * shares + (1 - _GUESSED) * alike).astype(np.float32)


def _loaded(
    like: nn.Module, arrays: dict[str, NDArray[Any]], prefix: str
) -> dict[str, torch.Tensor]:
    return {
        name: torch.from_numpy(numbers(arrays, prefix + name, tuple(tensor.shape)))
        for name, tensor in like.state_dict().items()
    }


def _loaded_moments(
    arrays: dict[str, NDArray[Any]], prefix: str, shape: tuple[int, ...]
) -> dict[str, torch.Tensor]:
    """Return what AdamW keeps of a parameter; nothing before its first step."""
    if not any(name.startswith(prefix) for name in arrays):
        return {}
    kept = {
        'step': numbers(arrays, f'{prefix}step', (), low=0.0, high=_MOST_STEPS),
        'exp_avg': numbers(arrays, f'{prefix}exp_avg', shape),
        'exp_avg_sq': numbers(arrays, f'{prefix}exp_avg_sq', shape, low=0.0),
    }
    return {name: torch.from_numpy(array) for name, array in kept.items()}
