"""The configuration of the paper's network, importable without torch."""

from dataclasses import dataclass

import numpy as np

from ja_common.core.config import Configuration, parameter


@dataclass(frozen=True)
class NetworkConfig(Configuration):
    """Size and learning rates. The defaults are a reading of the paper that works."""

    hidden: int = parameter(7, 'hidden units', low=1, high=4096)
    learning_rate: float = parameter(0.003, 'step of back-propagation', low=0.0, high=10.0)
    momentum: float = parameter(0.5, 'momentum of back-propagation', low=0.0, high=0.999)
    pairs: str = parameter(
        'all',
        'pairs that a trial gives: the displacement that remained at all postures, or at the last',
        choices=('all', 'last'),
    )
    angle_scale_rad: float = parameter(
        float(np.radians(40)), 'angle that stands for 1 at input and output', low=0.01, high=3.15
    )
    face_scaling: str = parameter(
        'centred',
        'pixels as fractions of white minus a half, or standardised to mean 0 and deviation 1',
        choices=('centred', 'standardised'),
    )
    posture_input: bool = parameter(
        True, 'give the network the posture; without it, the face is its only input'
    )
    initial_weight: float = parameter(
        0.05, 'weights start uniformly within +- this', low=0.0, high=10.0
    )
    believed_within_rad: float = parameter(
        0.15,
        'standard deviation of the belief about the gaze target, around the one direction that '
        'the network proposes: nothing in the paper, and nothing in its learning, depends on it',
        low=0.01, high=3.15,
    )  # fmt: skip
