"""A face code from watching her: which two numbers predict how her face differs from its mean?

An autoencoder. A network reads an odd and an even number of a picture; from them, and from her
mean face, the picture is predicted: its odd part from odd monomials of the numbers, its even part
from even ones. That is the turned face from the usual one, and it needs no label of any kind. The
network sees the picture through a small known warp that the prediction has to undo, so that its
numbers do not depend on where the detector has cut the face out.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from ja_learning.core.face_code import CHANNELS, WATCHED, CodeOrigin, FaceCode, member_alone
from ja_learning.core.face_warps import warped
from ja_learning.core.gaze_line_network import GazeLineNetwork
from ja_learning.core.mean_face import CONTRAST_SCALE, contrasts, standardised
from ja_learning.core.trial import FACE_SHAPE

_MEMBERS, _STEPS, _BATCH, _STEP_SIZE = 3, 600, 64, 0.003
_CODER_DECAY, _PICTURE_DECAY = 0.1, 0.01
_SMALLEST = 1e-3
_WARPED_SIZE = 0.08


def watched_face_code(pictures: NDArray[np.uint8], seconds: float, seed: int) -> FaceCode:
    """Train a code on pictures of one person, uint8 (n, 30, 25), watched for so many seconds.

    Several members learn side by side, as one alone may end in a local minimum; that of the
    smallest error is the code.
    """
    mean_face = standardised(pictures).mean(axis=0)
    faces = torch.from_numpy(contrasts(pictures, mean_face))[:, None]
    # The warp moves all of the picture, as the detector does.
    mean = CONTRAST_SCALE * torch.from_numpy(mean_face)
    generator = torch.Generator().manual_seed(seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = GazeLineNetwork(_MEMBERS, CHANNELS)
        predictor = _Predictor(_MEMBERS, faces[0].numel())
    optimiser = torch.optim.AdamW(
        [
            {'params': network.weights(), 'weight_decay': _CODER_DECAY},
            {'params': predictor.parameters(), 'weight_decay': _PICTURE_DECAY},
        ],
        lr=_STEP_SIZE,
    )
    schedule = torch.optim.lr_scheduler.LambdaLR(
        optimiser, lambda step: min(1.0, 2 * (1 - step / _STEPS) + 0.02)
    )
    for _ in range(_STEPS):
        chosen = faces[torch.randint(len(faces), (_BATCH,), generator=generator)]
        seen = warped(chosen + mean, _WARPED_SIZE, generator) - mean
        loss = _errors(predictor(network.gaze(seen)), chosen)
        optimiser.zero_grad()
        loss.sum().backward()
        optimiser.step()
        schedule.step()
    with torch.no_grad():
        numbers = network.gaze(faces)
        best = int(torch.argmin(_errors(predictor(numbers), faces)))
        deviations = numbers[best].square().mean(dim=0).sqrt().double().numpy()
    return FaceCode(
        member_alone(network, best),
        np.maximum(deviations, _SMALLEST),
        CodeOrigin(WATCHED, seconds),
        mean_face,
    )


def _errors(predicted: torch.Tensor, pictures: torch.Tensor) -> torch.Tensor:
    """Return the mean squared error (members,) of predictions (members, n, pixels)."""
    return torch.square(predicted - pictures.flatten(1)).mean(dim=(1, 2))


class _Predictor(nn.Module):
    """The contrasts of pictures (members, n, pixels) from two numbers each, (members, n, 2)."""

    def __init__(self, members: int, pixels: int) -> None:
        super().__init__()
        self.odd = nn.Parameter(0.01 * torch.randn(members, 5, pixels))
        self.even = nn.Parameter(0.01 * torch.randn(members, 6, pixels))

    def forward(self, numbers: torch.Tensor) -> torch.Tensor:
        deviations = numbers.square().mean(dim=1, keepdim=True).sqrt() + _SMALLEST
        a, b = (numbers / deviations).unbind(-1)
        odd = torch.stack([a, a**3, a * b, a * b**2, a**3 * b], dim=-1)
        even = torch.stack([torch.ones_like(a), b, b**2, a**2, a**2 * b, b**3], dim=-1)
        return odd @ _part(self.odd, -1) + even @ _part(self.even, 1)


def _part(pictures: torch.Tensor, sign: int) -> torch.Tensor:
    """Return the odd (-1) or the even (1) part of pictures (..., pixels) in a mirror."""
    rows = pictures.unflatten(-1, FACE_SHAPE)
    return ((rows + sign * rows.flip(-1)) / 2).flatten(-2)
