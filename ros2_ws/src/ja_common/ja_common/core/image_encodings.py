"""Raw image data in the encodings of common cameras, as ``(H, W, 3)`` uint8 RGB."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.sample_depth import SampleDepth

Pixels = NDArray[np.uint8]


class ImageError(ValueError):
    """Image data that cannot be turned into a picture; the text has the reason."""


@dataclass(frozen=True)
class RawImage:
    """Image data as it came: ``data`` (n,) uint8, ``step`` bytes from row to row."""

    data: Pixels
    encoding: str
    width: int
    height: int
    step: int
    big_endian: bool = False

    def __str__(self) -> str:
        return f"{self.width}x{self.height} '{self.encoding[:40]}'"

    def rows(self, offset: int, height: int, row_bytes: int, step: int) -> Pixels:
        """Return ``height`` rows (height, row_bytes) from a byte on, without their padding."""
        # The last row may lack its padding: some drivers cut it off.
        needed = offset + step * (height - 1) + row_bytes
        if self.data.size < needed:
            raise ImageError(
                f'{self.data.size} bytes of data, but {self} with step {self.step} takes {needed}'
            )
        view = np.lib.stride_tricks.as_strided(
            self.data[offset:], (height, row_bytes), (step, 1), writeable=False
        )
        return np.ascontiguousarray(view)


@dataclass(frozen=True)
class _Packed:
    """Pixels one after the other: ``samples`` a pixel, converted by a code of OpenCV."""

    samples: int
    code: int | None
    sample_bytes: int = 1
    bits: int = 0
    """Significant bits where the encoding itself states them."""

    def decode(self, image: RawImage, depth: SampleDepth) -> Pixels:
        if self.samples == 2 and image.width % 2:
            raise ImageError(f"a '{image.encoding}' image needs an even width, not {image.width}")
        row_bytes = _checked_row(image, image.width * self.samples * self.sample_bytes)
        pixels = image.rows(0, image.height, row_bytes, image.step)
        if self.sample_bytes == 2:
            samples = pixels.view('>u2' if image.big_endian else '<u2')
            depth = SampleDepth(self.bits) if self.bits else depth
            pixels = depth.to_8_bits(samples.astype(np.uint16, copy=False))
        if self.samples > 1:
            pixels = pixels.reshape(image.height, image.width, self.samples)
        return pixels if self.code is None else cv2.cvtColor(pixels, self.code)


@dataclass(frozen=True)
class _Planar:
    """A plane of brightness, then one of U and V in turn, or one of each.

    ``every``: (columns, rows) of pixels that share one colour.
    """

    every: tuple[int, int]
    interleaved: bool
    v_first: bool

    def decode(self, image: RawImage, depth: SampleDepth) -> Pixels:
        width, height, (across, down) = image.width, image.height, self.every
        if width % 2 or height % down:
            needed = 'width and height' if down == 2 else 'width'
            raise ImageError(
                f"a '{image.encoding}' image needs an even {needed}, not {width}x{height}"
            )
        _checked_row(image, width)
        luma = image.rows(0, height, width, image.step)
        offset, rows, columns = image.step * height, height // down, width // across
        if self.interleaved:
            both = image.rows(offset, rows, 2 * columns, 2 * image.step // across)
            first, second = both[:, ::2], both[:, 1::2]
        else:
            step = image.step // across
            first = image.rows(offset, rows, columns, step)
            second = image.rows(offset + step * rows, rows, columns, step)
        u, v = (second, first) if self.v_first else (first, second)
        return _rgb(luma, u, v, self.every)


def _rgb(luma: Pixels, u: Pixels, v: Pixels, every: tuple[int, int]) -> Pixels:
    """Return RGB of planes; OpenCV converts NV12 itself, the others by way of it."""
    height, width = luma.shape
    if every == (2, 2):
        both = np.stack([u, v], axis=-1)
        return cv2.cvtColorTwoPlane(luma, both, cv2.COLOR_YUV2RGB_NV12)
    # ITU-R BT.601, as OpenCV reads NV12; colours of single pixels go by pairs.
    pairs = np.empty((height, width, 2), np.uint8)
    pairs[..., 0] = luma
    pairs[:, ::2, 1], pairs[:, 1::2, 1] = u[:, :: 2 // every[0]], v[:, :: 2 // every[0]]
    return cv2.cvtColor(pairs, cv2.COLOR_YUV2RGB_YUY2)


def _checked_row(image: RawImage, row_bytes: int) -> int:
    if image.step < row_bytes:
        raise ImageError(
            f"step is {image.step}, but a row of {image.width} '{image.encoding}' pixels "
            f'takes {row_bytes} bytes'
        )
    return row_bytes


_BAYER = {
    'rggb': cv2.COLOR_BayerRGGB2RGB,
    'bggr': cv2.COLOR_BayerBGGR2RGB,
    'gbrg': cv2.COLOR_BayerGBRG2RGB,
    'grbg': cv2.COLOR_BayerGRBG2RGB,
}
_GREY = cv2.COLOR_GRAY2RGB
_DEEP = (10, 12, 14)
_UYVY, _YUY2 = _Packed(2, cv2.COLOR_YUV2RGB_UYVY), _Packed(2, cv2.COLOR_YUV2RGB_YUY2)

_ENCODINGS: dict[str, _Packed | _Planar] = {
    'rgb8': _Packed(3, None),
    'bgr8': _Packed(3, cv2.COLOR_BGR2RGB),
    '8uc3': _Packed(3, cv2.COLOR_BGR2RGB),
    'rgba8': _Packed(4, cv2.COLOR_RGBA2RGB),
    'bgra8': _Packed(4, cv2.COLOR_BGRA2RGB),
    '8uc4': _Packed(4, cv2.COLOR_BGRA2RGB),
    'mono8': _Packed(1, _GREY),
    '8uc1': _Packed(1, _GREY),
    'rgb16': _Packed(3, None, 2),
    'bgr16': _Packed(3, cv2.COLOR_BGR2RGB, 2),
    '16uc3': _Packed(3, cv2.COLOR_BGR2RGB, 2),
    'rgba16': _Packed(4, cv2.COLOR_RGBA2RGB, 2),
    'bgra16': _Packed(4, cv2.COLOR_BGRA2RGB, 2),
    '16uc4': _Packed(4, cv2.COLOR_BGRA2RGB, 2),
    'mono16': _Packed(1, _GREY, 2),
    '16uc1': _Packed(1, _GREY, 2),
    **{f'mono{bits}': _Packed(1, _GREY, 2, bits) for bits in _DEEP},
    # In ROS 'yuv422' is the older name of UYVY.
    'yuv422': _UYVY,
    'uyvy': _UYVY,
    'yuv422_yuy2': _YUY2,
    'yuyv': _YUY2,
    'yuy2': _YUY2,
    'yvyu': _Packed(2, cv2.COLOR_YUV2RGB_YVYU),
    'nv12': _Planar((2, 2), interleaved=True, v_first=False),
    'nv21': _Planar((2, 2), interleaved=True, v_first=True),
    'nv16': _Planar((2, 1), interleaved=True, v_first=False),
    'nv61': _Planar((2, 1), interleaved=True, v_first=True),
    'nv24': _Planar((1, 1), interleaved=True, v_first=False),
    'nv42': _Planar((1, 1), interleaved=True, v_first=True),
    **dict.fromkeys(
        ('i420', 'yuv420', 'yuv420p', 'yu12'),
        _Planar((2, 2), interleaved=False, v_first=False),
    ),
    'yv12': _Planar((2, 2), interleaved=False, v_first=True),
    'yuv422p': _Planar((2, 1), interleaved=False, v_first=False),
    **{f'bayer_{name}8': _Packed(1, code) for name, code in _BAYER.items()},
    **{f'bayer_{name}16': _Packed(1, code, 2) for name, code in _BAYER.items()},
    **{
        f'bayer_{name}{bits}': _Packed(1, code, 2, bits)
        for name, code in _BAYER.items()
        for bits in _DEEP
    },
}
_NO_PICTURES = ('32fc', '64fc', '8sc', '16sc', '32sc')


def decode_raw(image: RawImage, depth: SampleDepth) -> Pixels:
    """Return the picture of raw image data as ``(H, W, 3)`` uint8 RGB.

    It may share memory with the data: do not write. Raises ``ImageError`` when the encoding is
    unknown or the sizes contradict each other.
    """
    encoding = image.encoding.strip().lower()
    if encoding.startswith(_NO_PICTURES):
        raise ImageError(
            f"encoding '{image.encoding[:40]}' holds depth or other measurements, no picture: "
            'remap image_raw to the colour or grey image of the camera'
        )
    if encoding not in _ENCODINGS:
        raise ImageError(
            f"encoding '{image.encoding[:40]}' is not supported (known: {', '.join(_ENCODINGS)}): "
            'set the camera driver to one of these'
        )
    if image.width == 0 or image.height == 0:
        raise ImageError(f'the image has no pixels ({image.width}x{image.height})')
    try:
        return _ENCODINGS[encoding].decode(image, depth)
    except cv2.error as error:
        raise ImageError(f'{image} cannot be converted: {error.err}') from error


def demosaic(grey: Pixels, encoding: str) -> Pixels:
    """Return RGB of an (H, W) uint8 mosaic, of an encoding that begins with `bayer_`."""
    name = encoding.strip().lower().removeprefix('bayer_')[:4]
    if name not in _BAYER:
        raise ImageError(f"encoding '{encoding[:40]}' is no known mosaic ({', '.join(_BAYER)})")
    return cv2.cvtColor(grey, _BAYER[name])
