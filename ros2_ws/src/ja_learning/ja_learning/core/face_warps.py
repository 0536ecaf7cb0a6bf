"""Small known changes of pictures of a face, as another look would show it."""

import torch
from torch import nn

SIZE, PLACE_PIXELS, NOISE = 0.08, 1.0, 0.3
"""How far a warp goes: its size (a share), its place, its pixels (in units of a contrast)."""


def warped(pictures: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """Enlarge and move each of pictures (n, 1, rows, columns) a little, and add noise."""
    scale, *shift = 2 * torch.rand((3, len(pictures)), generator=generator) - 1
    maps = torch.zeros(len(pictures), 2, 3)
    maps[:, 0, 0] = maps[:, 1, 1] = 1 + SIZE * scale
    # In units of half a picture, x before y.
    for axis, pixels in enumerate((pictures.shape[-1], pictures.shape[-2])):
        maps[:, axis, 2] = 2 / pixels * PLACE_PIXELS * shift[axis]
    grid = nn.functional.affine_grid(maps, list(pictures.shape), align_corners=False)
    moved = nn.functional.grid_sample(pictures, grid, padding_mode='border', align_corners=False)
    return moved + NOISE * torch.randn(pictures.shape, generator=generator)
