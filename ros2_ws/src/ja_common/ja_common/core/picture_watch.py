"""Pictures that decode well and show nothing: nearly black, nearly white, or always the same."""

import zlib

import numpy as np
from numpy.typing import NDArray

_BLACK = 16
_WHITE = 250
# A light in a black picture, or a dark speck in a white one, is not enough to see by.
_SHOWN_SHARE = 0.01
_BLIND_AFTER_S = 2.0
# About so many pixels are looked at: 0.1 ms an image of any size.
_SAMPLES = 2000
_CHECKSUM_EVERY_S = 1.0


class PictureWatch:
    """Watches image after image; times in seconds, monotonic."""

    def __init__(self, frozen_after_s: float) -> None:
        self._frozen_after_s = frozen_after_s
        self._blind = ''
        self._blind_since_s = 0.0
        self._sample: NDArray[np.uint8] | None = None
        self._checksum: int | None = None
        self._summed_s = 0.0
        self._same_since_s = 0.0

    def record_picture(self, picture: NDArray[np.uint8], now_s: float) -> str | None:
        """Return the problem of an (H, W, 3) picture that has lasted for seconds; None if none."""
        every = max(1, round((picture.shape[0] * picture.shape[1] / _SAMPLES) ** 0.5))
        sample = picture[::every, ::every]
        return self._judge_brightness(sample, now_s) or self._judge_change(picture, sample, now_s)

    def _judge_brightness(self, sample: NDArray[np.uint8], now_s: float) -> str | None:
        blind = ''
        if np.count_nonzero(sample >= _BLACK) < _SHOWN_SHARE * sample.size:
            blind = (
                'the images are nearly black: is the lens covered, the exposure too short, or '
                'significant_bits too high?'
            )
        elif np.count_nonzero(sample < _WHITE) < _SHOWN_SHARE * sample.size:
            blind = (
                'the images are nearly white: is the exposure too long, or significant_bits too '
                'low?'
            )
        if blind != self._blind:
            self._blind, self._blind_since_s = blind, now_s
        lasts = now_s - self._blind_since_s >= _BLIND_AFTER_S
        return blind if blind and lasts else None

    def _judge_change(
        self, picture: NDArray[np.uint8], sample: NDArray[np.uint8], now_s: float
    ) -> str | None:
        if not self._frozen_after_s:
            return None
        if self._sample is None or not np.array_equal(sample, self._sample):
            self._sample, self._checksum, self._same_since_s = sample.copy(), None, now_s
        elif self._checksum is None or now_s - self._summed_s >= _CHECKSUM_EVERY_S:
            # A checksum of the whole only where the sample leaves it open.
            checksum = zlib.crc32(np.ascontiguousarray(picture).data)
            if self._checksum is not None and checksum != self._checksum:
                self._same_since_s = now_s
            self._checksum, self._summed_s = checksum, now_s
        same_s = now_s - self._same_since_s
        if same_s < self._frozen_after_s:
            return None
        return (
            f'every image for {same_s:.0f} s is the same, byte for byte: does the camera or its '
            'driver stand still? (A still picture or a simulation may be so: frozen_after_s = 0 '
            'ends this warning)'
        )
