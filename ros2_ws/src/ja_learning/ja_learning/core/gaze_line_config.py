"""The configuration of the fast learner, importable without torch and numba."""

from dataclasses import dataclass

from ja_common.core.config import Configuration, parameter


@dataclass(frozen=True)
class GazeLineConfig(Configuration):
    """How the fast learner learns."""

    face_reader: str = parameter(
        'pixels',
        'what is read of her face: the 30x25 picture, or head pose and eyes from landmarks '
        '(face_gaze), which foreign weights have found and of which members, replay and weights '
        'below do not exist',
        choices=('pixels', 'landmarks'),
    )
    first_guess: str = parameter(
        'eigenfaces',
        'what reads her face until the networks can: nothing, or a linear map of the principal '
        'components of her faces, of which the whole posterior is known (pixels only); or such a '
        'map of a face code that was trained on watching her, or on others, each another track',
        choices=('none', 'eigenfaces', 'watched', 'others'),
    )
    face_code: str = parameter(
        '', 'file of the face code, for first_guess watched or others, by tools/train_face_code.py'
    )
    members: int = parameter(6, 'networks that learn side by side', low=1, high=64)
    replay_steps: int = parameter(4, 'gradient steps a trial', low=1, high=1000)
    replay_batch: int = parameter(32, 'trials a gradient step', low=1, high=4096)
    replay_memory: int = parameter(5000, 'trials kept for replay', low=1, high=100000)
    step_size: float = parameter(0.003, 'step size of AdamW', low=1e-6, high=1.0)
    weight_decay: float = parameter(
        0.5, 'decay of the weights that code a face, as in AdamW', low=0.0, high=100.0
    )
    channels: int = parameter(8, 'channels of the first convolution', low=1, high=256)
    none_was_meant: float = parameter(
        0.05, 'prior probability that no candidate is the attended object', low=1e-4, high=0.9
    )
    top_down: bool = parameter(
        True,
        'propose the most probable of the objects that were seen; else always the best guess on '
        'the line of gaze, whatever stands there',
    )
    plausible_within_nats: float = parameter(
        4.5,
        'a seen object is proposed when its log density is this near to that of the best guess; '
        'else the head goes and looks there',
        low=0.0, high=100.0,
    )  # fmt: skip
