"""Samples of 10 to 16 bits in 16, as pictures of 8 bits."""

import numpy as np
from numpy.typing import NDArray

_COMMON_BITS = (10, 12, 14, 16)


class SampleDepth:
    """How many of 16 bits a camera uses: ``significant_bits``, or 0 to find out.

    Then it is the least common depth that holds the brightest sample of all images so far. It can
    only grow, so that the picture does not flicker with the brightness of the scene.
    """

    def __init__(self, significant_bits: int = 0) -> None:
        self._fixed = significant_bits
        self.bits = significant_bits or _COMMON_BITS[0]
        """Bits taken as significant so far."""

    def to_8_bits(self, samples: NDArray[np.uint16]) -> NDArray[np.uint8]:
        """Return samples of any shape as uint8; what exceeds the depth is white."""
        if not self._fixed and samples.size:
            needed = int(samples.max()).bit_length()
            self.bits = max(self.bits, next(bits for bits in _COMMON_BITS if bits >= needed))
        shifted = samples >> (self.bits - 8)
        if self._fixed and self.bits < 16:
            shifted = np.minimum(shifted, 255)
        return shifted.astype(np.uint8)
