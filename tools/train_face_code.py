"""Train a face code for the fast learner: the tracks self-supervised and synthetic others.

Her own pictures, watched for 60 s of the rendered world, or any array uint8 (n, 30, 25) of them:

.venv/bin/python tools/train_face_code.py watched code.npz --seed 0 --seconds 60
.venv/bin/python tools/train_face_code.py watched code.npz --pictures her.npy

Candidate sets of other caregivers, of people that the test must not have (docs/tracks.md):

.venv/bin/python tools/train_face_code.py others code.npz --people chiyo dieter efua ivo
"""

import argparse
from pathlib import Path

import numpy as np
import torch

from ja_experiments.face_codes import (
    OTHERS_SEEDS,
    OTHERS_TRIALS,
    code_of_others,
    code_of_pictures,
    code_of_watching,
)
from ja_learning.core.face_code import save_face_code
from ja_learning.core.trial import checked_face
from ja_sim.core.caregiver import identities
from ja_sim.core.scene import load_scene


def parsed() -> argparse.Namespace:
    """Return the arguments of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    ways = parser.add_subparsers(dest='way', required=True)
    watched = ways.add_parser('watched', help='from her own pictures, without any label')
    watched.add_argument('--seed', type=int, default=0, help='of the caregiver')
    watched.add_argument('--seconds', type=float, default=60.0, help='to watch her')
    watched.add_argument('--pictures', type=Path, help='an array (.npy) in place of the world')
    others = ways.add_parser('others', help='from candidate sets of other caregivers')
    others.add_argument('--people', nargs='+', choices=identities(), required=True)
    others.add_argument('--seeds', type=int, nargs='+', default=OTHERS_SEEDS)
    others.add_argument('--trials', type=int, default=OTHERS_TRIALS, help='of each caregiver')
    for each in (watched, others):
        each.add_argument('file', type=Path, help='to write, .npz')
        each.add_argument('--scene', default='default')
        each.add_argument('--training-seed', type=int, default=0)
    return parser.parse_args()


def main() -> None:
    """Train a code, write it, and state what it was trained on."""
    given = parsed()
    # Several threads only wait for each other: the network is small.
    torch.set_num_threads(1)
    scene, seed = load_scene(given.scene), given.training_seed
    if given.way == 'others':
        code = code_of_others(scene, given.people, seed, given.seeds, given.trials, print)
    elif given.pictures is None:
        code = code_of_watching(scene, given.seed, given.seconds, seed)
    else:
        code = code_of_pictures(np.array([*map(checked_face, np.load(given.pictures))]), seed)
    save_face_code(given.file, code)
    origin = code.origin
    print(
        f'{given.file}: trained on {origin.trained_on}, {origin.caregivers} caregivers '
        f'({", ".join(origin.people) or "herself"}), {origin.trials} candidate sets, '
        f'{origin.seconds:.0f} s of pictures'
    )


if __name__ == '__main__':
    main()
