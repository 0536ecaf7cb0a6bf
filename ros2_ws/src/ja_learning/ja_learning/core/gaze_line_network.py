"""Beliefs about the gaze target, on the line of her gaze: several small networks in one.

A face gives a gaze u, and the gaze target stands somewhere along it, since the direction of a gaze
does not show depth: o + r_k u away from her face, with probability w_k. A stretch r_k is
known to s_r (a share of it), which lets it reach into the next; the gaze to s_u, a place to s_c
(`gaze_line_mixture`). u is a convolutional network, odd in pan and even in tilt under a mirror (a
face is symmetric, and so is the task). o is where the lines begin: at her eyes, which are above
the middle of what the detector takes for a face, so that o has a tilt alone. Angles are in units
of `ANGLE_SCALE_RAD`.
"""

import math

import numpy as np
import torch
from torch import nn

from ja_learning.core.gaze_line_mixture import (
    FIRST_STRETCH,
    LAST_STRETCH,
    STRETCH_COUNT,
    LineMixture,
    powers,
)
from ja_learning.core.gaze_line_places import COVARIANCE, FROM_EYES, HER_DISTANCE, IN_VIEW
from ja_learning.core.trial import FACE_SHAPE

STRETCHES = torch.exp(torch.linspace(np.log(FIRST_STRETCH), np.log(LAST_STRETCH), STRETCH_COUNT))
_HIDDEN = 64


class GazeLineNetwork(nn.Module):
    """`members` networks side by side, each with weights of its own, in grouped operations.

    Every parameter has the members along its first axis, each an equal part of it.
    """

    def __init__(self, members: int, channels: int) -> None:
        """Draw the initial weights from torch's generator."""
        super().__init__()
        self.members = members
        narrow, wide = members * channels, members * 2 * channels
        rows, columns = (math.ceil(size / 8) for size in FACE_SHAPE)
        self.coder = nn.Sequential(
            nn.Conv2d(members, narrow, 5, stride=2, padding=2, groups=members),
            nn.ReLU(),
            nn.Conv2d(narrow, wide, 3, stride=2, padding=1, groups=members),
            nn.ReLU(),
            nn.Conv2d(wide, wide, 3, stride=2, padding=1, groups=members),
            nn.ReLU(),
        )
        codes = 2 * channels * rows * columns
        self.hidden_weights = nn.Parameter(_uniform(codes, (members, codes, _HIDDEN)))
        self.hidden_biases = nn.Parameter(_uniform(codes, (members, 1, _HIDDEN)))
        self.gaze_weights = nn.Parameter(_uniform(_HIDDEN, (members, _HIDDEN, 2)))
        self.gaze_biases = nn.Parameter(_uniform(_HIDDEN, (members, 1, 2)))
        self.origin_tilt = nn.Parameter(torch.zeros(members, 1))
        self.stretch_logits = nn.Parameter(torch.zeros(members, len(STRETCHES)))
        self.log_gaze_deviation = nn.Parameter(torch.full((members, 1), 0.08).log())
        self.log_stretch_deviation = nn.Parameter(torch.full((members, 1), 0.12).log())
        self.log_place_deviation = nn.Parameter(torch.full((members, 1), 0.05).log())

    def weights(self) -> list[nn.Parameter]:
        """Return the weights of the layers that code a face, without biases."""
        layers = [part for part in self.coder if isinstance(part, nn.Conv2d)]
        return [*(layer.weight for layer in layers), self.hidden_weights, self.gaze_weights]

    def gaze(self, faces: torch.Tensor) -> torch.Tensor:
        """Return u, (members, n, 2), of contrasts of faces (n, members or 1, 30, 25)."""
        faces = faces.expand(-1, self.members, -1, -1)
        # Grouped convolutions are faster with the channels last.
        pictures = torch.cat([faces, faces.flip(-1)]).to(memory_format=torch.channels_last)
        codes = self.coder(pictures).reshape(len(pictures), self.members, -1).transpose(0, 1)
        hidden = torch.relu(codes @ self.hidden_weights + self.hidden_biases)
        seen, mirrored = (hidden @ self.gaze_weights + self.gaze_biases).chunk(2, dim=1)
        pan, tilt = seen[..., 0] - mirrored[..., 0], seen[..., 1] + mirrored[..., 1]
        return torch.stack([pan, tilt], dim=-1) / 2

    def mixture(self) -> LineMixture[torch.Tensor]:
        """Return the numbers of the belief beside the gaze."""
        return LineMixture(
            stretches=STRETCHES,
            log_shares=torch.log_softmax(self.stretch_logits, dim=-1)[:, None],
            origin_tilt=self.origin_tilt[:, None],
            of_stretch=self.log_stretch_deviation.mul(2).exp()[:, None],
            of_gaze=self.log_gaze_deviation.mul(2).exp()[:, None],
            of_place=self.log_place_deviation.mul(2).exp()[:, None],
        )

    def log_density(self, gaze: torch.Tensor, places: torch.Tensor) -> torch.Tensor:
        """Return log p(c | face), (members, n, m), of places (members or 1, n or 1, m, 2)."""
        return torch.logsumexp(_powers(places) @ self._forms(gaze), dim=-1)

    def log_ratio(
        self, gaze: torch.Tensor, places: torch.Tensor, negatives: torch.Tensor
    ) -> torch.Tensor:
        """Return log p(c | face), (members, n, m), less log of its mean; -inf where c is NaN.

        `places`: (members or 1, n or 1, m, 8), seen in a trial; `negatives`: (members, k, 8), seen
        in others; columns as in `gaze_line_places`. The mean is over both, so that no ratio is
        beyond their number.
        """
        forms, missing = self._forms(gaze), torch.isnan(places[..., 0])
        here = torch.logsumexp(_powers(torch.nan_to_num(places[..., IN_VIEW])) @ forms, dim=-1)
        here = self._with_ranges(here, gaze, places)
        here = here.masked_fill(missing, -torch.inf)
        # One product for each member, not for each of its gazes.
        there = _powers(negatives[..., IN_VIEW]) @ forms.transpose(1, 2).flatten(2)
        there = there.unflatten(2, (-1, len(STRETCHES)))
        if torch.isnan(negatives[..., HER_DISTANCE]).all():
            there = torch.logsumexp(there, dim=(1, 3))
        else:
            each = torch.logsumexp(there, dim=3).transpose(1, 2)
            there = torch.logsumexp(self._with_ranges(each, gaze, negatives[:, None]), dim=2)
        total = torch.logaddexp(torch.logsumexp(here, dim=-1), there)
        count = (~missing).sum(-1) + negatives.shape[1]
        return here - (total - torch.log(count))[..., None]

    def _with_ranges(
        self, line: torch.Tensor, gaze: torch.Tensor, places: torch.Tensor
    ) -> torch.Tensor:
        """Return `line` (members, n, m), replaced where the distances of places are known."""
        known = ~torch.isnan(places[..., HER_DISTANCE])
        if not known.any():
            return line
        # Where unknown, any number will do, but NaN would spread to the gradients.
        places = torch.nan_to_num(places, nan=1.0)
        pan, tilt = gaze.split(1, dim=-1)
        from_eyes = self.mixture().log_from_eyes(
            (pan, tilt),
            places[..., FROM_EYES].unbind(-1),
            places[..., HER_DISTANCE],
            places[..., COVARIANCE].unbind(-1),
            torch.log,
            torch.exp,
        )
        return torch.where(known, from_eyes, line)

    def _forms(self, gaze: torch.Tensor) -> torch.Tensor:
        """Return the forms of the parts of p(c | face), (members, n, 6, stretches)."""
        pan, tilt = gaze.split(1, dim=-1)
        return torch.stack(self.mixture().forms(pan, tilt, torch.log), dim=2)


def give_member(tensor: torch.Tensor, members: int, giver: int, taker: int) -> None:
    """Overwrite one member's part of a parameter, or of what an optimiser keeps, by another's."""
    parts = tensor.reshape(members, -1)
    parts[taker] = parts[giver]


def _uniform(inputs: int, shape: tuple[int, ...]) -> torch.Tensor:
    """Draw weights as torch initialises a linear layer of so many inputs."""
    return (2 * torch.rand(shape) - 1) / math.sqrt(inputs)


def _powers(places: torch.Tensor) -> torch.Tensor:
    return torch.stack(powers(*places.unbind(-1)), dim=-1)
