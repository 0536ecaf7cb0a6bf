"""The gaze of a face in one compiled pass: `GazeLineNetwork.gaze`, where an answer is due soon.

Torch learns. To answer with it takes forty operations. Each of them costs more than its arithmetic
when another thread has used the caches meanwhile, and waits for the interpreter again while that
thread learns: four times as long as this pass (docs/lab_notes/learner.md). A test holds the two
together.
"""

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from torch import nn

from ja_learning.core.compiled import compiled
from ja_learning.core.gaze_line_network import GazeLineNetwork

# Weights (inputs, outputs) and biases (outputs,), for each member where there is one axis more;
# inputs are ordered by row, column and channel.
_Layer = tuple[NDArray[np.float32], NDArray[np.float32]]


class GazeLinePass:
    """The gazes of a network as it is now; later updates do not show."""

    def __init__(self, network: GazeLineNetwork) -> None:
        """Copy the weights of the network."""
        members = network.members
        convolutions = [part for part in network.coder if isinstance(part, nn.Conv2d)]
        first, *others = (_convolution(layer, members) for layer in convolutions)
        # All members see the same picture: to the first layer they are channels of one.
        weights = np.concatenate(list(first[0]), axis=1)
        channels = convolutions[-1].out_channels // members
        hidden = _array(network.hidden_weights)
        by_channel = hidden.reshape(members, channels, -1, hidden.shape[-1])
        hidden = by_channel.transpose(0, 2, 1, 3).reshape(hidden.shape)
        self._layers: tuple[_Layer, ...] = (
            (weights, first[1].ravel()),
            *others,
            (hidden, _array(network.hidden_biases)[:, 0]),
            (_array(network.gaze_weights), _array(network.gaze_biases)[:, 0]),
        )

    def __call__(self, faces: ArrayLike) -> NDArray[np.float64]:
        """Return u, shape (members, n, 2), of faces, as contrasts (n, 30, 25)."""
        return _gazes(np.ascontiguousarray(faces, np.float32), *self._layers)


def _convolution(layer: nn.Conv2d, members: int) -> _Layer:
    weights = _array(layer.weight)
    outputs, inputs, rows, columns = weights.shape
    weights = weights.reshape(members, outputs // members, inputs, rows, columns)
    weights = weights.transpose(0, 3, 4, 2, 1).reshape(members, rows * columns * inputs, -1)
    return weights, _array(layer.bias).reshape(members, -1)


def _array(parameter: nn.Parameter | None) -> NDArray[np.float32]:
    """Copy a parameter, which goes on learning."""
    assert parameter is not None
    return parameter.detach().numpy().copy()


@compiled
def _gazes(faces, first, second, third, hidden, gaze):  # type: ignore[no-untyped-def]
    members, channels = len(hidden[0]), first[0].shape[1] // len(hidden[0])
    found = np.zeros((members, len(faces), 2))
    for n in range(len(faces)):
        picture = _padded(faces[n])
        for mirrored in range(2):
            if mirrored:
                picture = np.ascontiguousarray(picture[:, ::-1])
            early = _convolved(picture, first[0], first[1], 5, 1)
            for m in range(members):
                of_member = early[:, :, m * channels : (m + 1) * channels]
                middle = _convolved(of_member, second[0][m], second[1][m], 3, 1)
                late = _convolved(middle, third[0][m], third[1][m], 3, 0)
                units = np.dot(late.reshape(-1), hidden[0][m]) + hidden[1][m]
                answer = np.dot(np.maximum(units, np.float32(0)), gaze[0][m]) + gaze[1][m]
                found[m, n, 0] += -answer[0] / 2 if mirrored else answer[0] / 2
                found[m, n, 1] += answer[1] / 2
    return found


@njit(nogil=True)
def _padded(face):  # type: ignore[no-untyped-def]
    """Return a face with two rows and columns of 0 around, (34, 29, 1)."""
    rows, columns = face.shape
    picture = np.zeros((rows + 4, columns + 4, 1), np.float32)
    picture[2 : rows + 2, 2 : columns + 2, 0] = face
    return picture


@njit(nogil=True)
def _convolved(picture, weights, biases, size, margin):  # type: ignore[no-untyped-def]
    """Convolve a picture (rows, columns, channels) with stride 2, rectify it, add margins of 0."""
    rows, columns = (picture.shape[0] - size) // 2 + 1, (picture.shape[1] - size) // 2 + 1
    seen = np.empty((rows * columns, size * size * picture.shape[2]), np.float32)
    for place in range(len(seen)):
        top, left = 2 * (place // columns), 2 * (place % columns)
        at = 0
        for row in range(top, top + size):
            for column in range(left, left + size):
                for channel in range(picture.shape[2]):
                    seen[place, at] = picture[row, column, channel]
                    at += 1
    sums = np.dot(seen, weights)
    found = np.zeros((rows + 2 * margin, columns + 2 * margin, weights.shape[1]), np.float32)
    for place in range(len(seen)):
        row, column = margin + place // columns, margin + place % columns
        for channel in range(weights.shape[1]):
            unit = sums[place, channel] + biases[channel]
            found[row, column, channel] = max(unit, np.float32(0))
    return found
