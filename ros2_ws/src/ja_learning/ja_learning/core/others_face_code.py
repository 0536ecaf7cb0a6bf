"""A face code from other caregivers: what their faces tell about which candidate was attended.

The likelihood is that of the fast learner (`gaze_line`): one of the objects that were seen in a
trial is the attended one, and no label says which. One network learns from the trials of all
caregivers, each face as the contrast to the mean face of its person. So it reads what the faces of
different people have in common when they turn.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from ja_learning.core.face_code import CHANNELS, OTHERS, CodeOrigin, FaceCode, member_alone
from ja_learning.core.face_warps import warped
from ja_learning.core.gaze_line_network import GazeLineNetwork
from ja_learning.core.mean_face import contrasts

_MEMBERS, _STEPS, _BATCH, _STEP_SIZE, _WEIGHT_DECAY = 3, 1500, 48, 0.003, 0.5
_NEGATIVES, _NONE_ATTENDED = 64, 0.05
_WARPED_SIZE = 0.08
# Annealing, as in `gaze_line`, takes this share of the steps; the running mean of the weights
# begins after so many.
_INITIAL_INVERSE_TEMPERATURE, _ANNEALED = 0.1, 0.4
_KEPT, _KEPT_AFTER = 0.98, 50


class OtherCaregiver(NamedTuple):
    """What was seen of one caregiver.

    `person`: her name; `faces`: uint8 (n, 30, 25), one a trial; `mean_face`: (30, 25), of
    standardised pictures; `places`: (n, m, 8), of the objects seen in each trial, as in
    `gaze_line_places`, NaN-padded.
    """

    person: str
    faces: NDArray[np.uint8]
    mean_face: NDArray[np.float32]
    places: NDArray[np.float32]


def others_face_code(caregivers: Sequence[OtherCaregiver], seconds: float, seed: int) -> FaceCode:
    """Train a code on the candidate sets of these caregivers, watched for so many seconds.

    Several members learn side by side; that of the largest likelihood is the code.
    """
    faces = torch.from_numpy(
        np.concatenate([contrasts(each.faces, each.mean_face) for each in caregivers])
    )
    places = torch.from_numpy(np.concatenate([each.places for each in caregivers]))
    seen = places[~torch.isnan(places[..., 0])]
    generator = torch.Generator().manual_seed(seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network, mean = (GazeLineNetwork(_MEMBERS, CHANNELS) for _ in range(2))
    mean.load_state_dict(network.state_dict())
    mean.requires_grad_(False)
    optimiser = torch.optim.AdamW(network.weights(), lr=_STEP_SIZE, weight_decay=_WEIGHT_DECAY)
    others = [
        parameter
        for parameter in network.parameters()
        if not any(parameter is weight for weight in network.weights())
    ]
    optimiser.add_param_group({'params': others, 'weight_decay': 0.0})
    schedule = torch.optim.lr_scheduler.LambdaLR(
        optimiser, lambda step: min(1.0, 3 * (1 - step / _STEPS) + 0.02)
    )
    losses = torch.zeros(_MEMBERS)
    for step in range(_STEPS):
        progress = step / (_ANNEALED * _STEPS)
        inverse_temperature = min(1.0, _INITIAL_INVERSE_TEMPERATURE + 0.9 * progress)
        chosen = torch.randint(len(faces), (_BATCH, _MEMBERS), generator=generator)
        negatives = seen[torch.randint(len(seen), (_MEMBERS, _NEGATIVES), generator=generator)]
        gaze = network.gaze(warped(faces[chosen], _WARPED_SIZE, generator))
        ratio = network.log_ratio(gaze, places[chosen].transpose(0, 1), negatives)
        loss = _loss(ratio, inverse_temperature)
        optimiser.zero_grad()
        loss.sum().backward()
        if inverse_temperature < 1.0 and network.origin_tilt.grad is not None:
            network.origin_tilt.grad.zero_()
        optimiser.step()
        schedule.step()
        with torch.no_grad():
            weight = 1 - _KEPT if step > _KEPT_AFTER else 1.0
            torch._foreach_lerp_(list(mean.parameters()), list(network.parameters()), weight)
            losses.lerp_(loss, weight)
    best = member_alone(mean, int(torch.argmin(losses)))
    deviations = best.gaze(faces[:, None])[0].square().mean(dim=0).sqrt().double().numpy()
    people = tuple(sorted({each.person for each in caregivers}))
    return FaceCode(
        best, deviations, CodeOrigin(OTHERS, seconds, len(caregivers), people, len(faces))
    )


def _loss(ratio: torch.Tensor, inverse_temperature: float) -> torch.Tensor:
    """Return minus the tempered log likelihood, (members,), of ratios (members, n, m)."""
    counts = torch.isfinite(ratio).sum(dim=-1, keepdim=True)
    one = inverse_temperature * ratio + np.log1p(-_NONE_ATTENDED) - torch.log(counts)
    none = torch.full_like(one[..., :1], inverse_temperature * np.log(_NONE_ATTENDED))
    both = torch.cat([one, none], dim=-1)
    return -(torch.logsumexp(both, dim=-1) / inverse_temperature).mean(dim=1)
