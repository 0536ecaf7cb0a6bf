"""Beliefs about what she means, on the line of her gaze: several small networks in one.

A face gives a gaze u, and what she means stands somewhere along it, since depth cannot be told
from the direction of a gaze. The displacement c from her face is a mixture over stretches r_k:

    p(c | face) = sum_k w_k N(c; o + r_k u, r_k^2 (s_r^2 u u^T + s_u^2 I) + s_c^2 I),  u = u(face)

A stretch is known to s_r (a share of it), which lets it reach into the next; the gaze to s_u, a
place to s_c. u is a convolutional network, odd in pan and even in tilt under a mirror (a face is
symmetric, and so is the task). o is where the lines begin: at her eyes, which are above the middle
of what the detector takes for a face, so that o has a tilt alone. Angles are in units of
`ANGLE_SCALE_RAD`.
"""

import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from ja_learning.core.trial import FACE_SHAPE

ANGLE_SCALE_RAD = float(np.radians(40))
STRETCHES = torch.exp(torch.linspace(np.log(0.35), np.log(2.2), 9))
_HIDDEN = 64


class GazeLineNetwork(nn.Module):
    """`members` networks side by side, each with weights of its own, in grouped operations.

    Every parameter has the members along its first axis, each an equal part of it.
    """

    def __init__(self, members: int, channels: int) -> None:
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

    def gaze(self, faces: torch.Tensor) -> torch.Tensor:
        """u, shape (members, n, 2), of standardised faces (n, members or 1, 30, 25)."""
        faces = faces.expand(-1, self.members, -1, -1)
        # Grouped convolutions are faster with the channels last.
        pictures = torch.cat([faces, faces.flip(-1)]).to(memory_format=torch.channels_last)
        codes = self.coder(pictures).reshape(len(pictures), self.members, -1).transpose(0, 1)
        hidden = torch.relu(codes @ self.hidden_weights + self.hidden_biases)
        seen, mirrored = (hidden @ self.gaze_weights + self.gaze_biases).chunk(2, dim=1)
        pan, tilt = seen[..., 0] - mirrored[..., 0], seen[..., 1] + mirrored[..., 1]
        return torch.stack([pan, tilt], dim=-1) / 2

    def on_line(self, gaze: torch.Tensor) -> torch.Tensor:
        """o + r_k u, (members, n, stretches, 2), of gazes u (members, n, 2)."""
        origin = nn.functional.pad(self.origin_tilt, (1, 0))
        return origin[:, None, None] + STRETCHES[:, None] * gaze[:, :, None]

    def forms(self, gaze: torch.Tensor) -> torch.Tensor:
        """The parts of p(c | face) for gazes u (members, n, 2): (members, n, 6, stretches).

        Each is a quadratic form: `quadratic(c) @ forms` is log of w_k N(c; ...). The largest work
        of a lesson, with every place for every gaze, is then one product of matrices.
        """
        squared = STRETCHES**2
        across = squared * self.log_gaze_deviation.mul(2).exp()
        across = (across + self.log_place_deviation.mul(2).exp())[:, None]
        further = (squared * self.log_stretch_deviation.mul(2).exp())[:, None]
        along = across + further * gaze.square().sum(-1, keepdim=True)
        # Of the covariance `across` I + `further` u u^T the inverse, by Sherman and Morrison.
        pan, tilt = gaze.split(1, dim=-1)
        less = further / along
        pans = (1 - less * pan**2) / across
        tilts = (1 - less * tilt**2) / across
        both = -less * pan * tilt / across
        at_pan, at_tilt = self.on_line(gaze).unbind(-1)
        to_pan, to_tilt = pans * at_pan + both * at_tilt, both * at_pan + tilts * at_tilt
        shares = torch.log_softmax(self.stretch_logits, dim=-1)[:, None]
        peak = shares - 0.5 * torch.log(across * along) - math.log(2 * math.pi)
        at_zero = peak - 0.5 * (at_pan * to_pan + at_tilt * to_tilt)
        return torch.stack([at_zero, to_pan, to_tilt, -0.5 * pans, -both, -0.5 * tilts], dim=2)

    def log_density(self, gaze: torch.Tensor, places: torch.Tensor) -> torch.Tensor:
        """log p(c | face), (members, n, m), of places (members or 1, n or 1, m, 2), given u."""
        return torch.logsumexp(quadratic(places) @ self.forms(gaze), dim=-1)

    def log_ratio(
        self, gaze: torch.Tensor, places: torch.Tensor, elsewhere: torch.Tensor
    ) -> torch.Tensor:
        """log p(c | face), (members, n, m), less log of its mean; -inf where c is NaN.

        `places`: (members or 1, n or 1, m, 2), seen in a trial; `elsewhere`: (members, k, 2), seen
        in others. The mean is over both, so that no ratio is beyond their number.
        """
        forms, missing = self.forms(gaze), torch.isnan(places[..., 0])
        here = torch.logsumexp(quadratic(torch.nan_to_num(places)) @ forms, dim=-1)
        here = here.masked_fill(missing, -torch.inf)
        # One product for each member, not for each of its gazes.
        there = quadratic(elsewhere) @ forms.transpose(1, 2).flatten(2)
        there = torch.logsumexp(there.unflatten(2, (-1, len(STRETCHES))), dim=(1, 3))
        total = torch.logaddexp(torch.logsumexp(here, dim=-1), there)
        count = (~missing).sum(-1) + elsewhere.shape[1]
        return here - (total - torch.log(count))[..., None]


def quadratic(places: torch.Tensor) -> torch.Tensor:
    """What a quadratic form of places (..., 2) is made of, (..., 6), in the order of `forms`."""
    pan, tilt = places.unbind(-1)
    return torch.stack([torch.ones_like(pan), pan, tilt, pan**2, pan * tilt, tilt**2], dim=-1)


def standardised(faces: NDArray[np.uint8] | torch.Tensor) -> torch.Tensor:
    """Faces uint8 (..., 30, 25), each with mean 0 and deviation 1."""
    pixels = torch.as_tensor(faces).float() / 255
    pixels -= pixels.mean(dim=(-2, -1), keepdim=True)
    deviation = pixels.square().mean(dim=(-2, -1), keepdim=True).sqrt()
    return pixels / deviation.clamp(min=1e-3)


def give_member(tensor: torch.Tensor, members: int, giver: int, taker: int) -> None:
    """Overwrite one member's part of a parameter, or of what an optimiser keeps, by another's."""
    parts = tensor.reshape(members, -1)
    parts[taker] = parts[giver]


def _uniform(inputs: int, shape: tuple[int, ...]) -> torch.Tensor:
    """As torch begins a linear layer of so many inputs."""
    return (2 * torch.rand(shape) - 1) / math.sqrt(inputs)
