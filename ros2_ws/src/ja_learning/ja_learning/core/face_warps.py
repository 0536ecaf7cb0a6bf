"""Small known changes of pictures of a face, as another look would show it."""

import torch
from torch import nn

_PLACE_PIXELS, _NOISE = 1.0, 0.3
"""How far a picture is moved, and the deviation of its noise, in units of a contrast."""


def warped(pictures: torch.Tensor, size: float, generator: torch.Generator) -> torch.Tensor:
    """Enlarge and move each of pictures (..., rows, columns) a little, and add noise.

    `size`: the largest change of size, as a share.
    """
    each = pictures.reshape(-1, 1, *pictures.shape[-2:])
    scale, *shift = 2 * torch.rand((3, len(each)), generator=generator) - 1
    maps = torch.zeros(len(each), 2, 3)
    maps[:, 0, 0] = maps[:, 1, 1] = 1 + size * scale
    # In units of half a picture, x before y.
    for axis, pixels in enumerate((each.shape[-1], each.shape[-2])):
        maps[:, axis, 2] = 2 / pixels * _PLACE_PIXELS * shift[axis]
    grid = nn.functional.affine_grid(maps, list(each.shape), align_corners=False)
    moved = nn.functional.grid_sample(each, grid, padding_mode='border', align_corners=False)
    noise = torch.randn(pictures.shape, generator=generator)
    return moved.reshape(pictures.shape) + _NOISE * noise
