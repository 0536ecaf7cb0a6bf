"""Train a face code for the fast learner: the tracks self-supervised and synthetic others.

Her own pictures, watched for 60 s of the rendered world, or any array uint8 (n, 30, 25) of them:

.venv/bin/python tools/train_face_code.py watched code.npz --seed 0 --seconds 60
.venv/bin/python tools/train_face_code.py watched code.npz --pictures her.npy

Candidate sets of other caregivers, of people that the test must not have (docs/tracks.md):

.venv/bin/python tools/train_face_code.py others code.npz --people chiyo dieter efua ivo
"""

import argparse
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import torch

from ja_experiments.datasets.watching import PICTURES_A_SECOND, watch
from ja_learning.core.face_code import FaceCode, save_face_code
from ja_learning.core.gaze_line_places import seen_places
from ja_learning.core.mean_face import standardised
from ja_learning.core.others_face_code import OtherCaregiver, others_face_code
from ja_learning.core.trial import checked_face
from ja_learning.core.watched_face_code import watched_face_code
from ja_sim.core.caregiver import identities
from ja_sim.core.scene import Scene, load_scene


def watched_pictures(scene: Scene, seed: int, seconds: float) -> np.ndarray:
    """Return the pictures (n, 30, 25) of so many seconds in which she was seen."""
    wanted = round(seconds * PICTURES_A_SECOND)
    pictures: list[np.ndarray] = []
    for each in watch(scene, seed):
        pictures.extend(each.pictures)
        if len(pictures) >= wanted:
            break
    return np.array(pictures[:wanted])


def other_caregiver(
    scene: Scene, person: str, seed: int, trials: int
) -> tuple[OtherCaregiver, int]:
    """Return what is seen of a person in so many trials, and in how many pictures."""
    scene = replace(scene, caregiver=replace(scene.caregiver, identity=person))
    looks = list(islice(watch(scene, seed), trials))
    pictures = np.concatenate([each.pictures for each in looks])
    places = np.array([seen_places(each.look, each.objects) for each in looks], np.float32)
    faces = np.array([each.look.face for each in looks])
    mean_face = standardised(pictures).mean(axis=0)
    return OtherCaregiver(person, faces, mean_face, places), len(pictures)


def code_of_others(
    scene: Scene, people: list[str], seeds: list[int], trials: int, seed: int
) -> FaceCode:
    """Train on one caregiver for each of the seeds, the people in turn."""
    caregivers, pictures = [], 0
    for index, each in enumerate(seeds):
        person = people[index % len(people)]
        caregiver, seen = other_caregiver(scene, person, each, trials)
        caregivers.append(caregiver)
        pictures += seen
        print(f'{person} (seed {each}): {trials} trials, {seen / PICTURES_A_SECOND:.0f} s')
    return others_face_code(caregivers, pictures / PICTURES_A_SECOND, seed)


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
    others.add_argument('--seeds', type=int, nargs='+', default=list(range(30, 42)))
    others.add_argument('--trials', type=int, default=120, help='of each caregiver')
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
    scene = load_scene(given.scene)
    if given.way == 'others':
        code = code_of_others(scene, given.people, given.seeds, given.trials, given.training_seed)
    else:
        if given.pictures is None:
            pictures = watched_pictures(scene, given.seed, given.seconds)
        else:
            pictures = np.array([*map(checked_face, np.load(given.pictures))])
        code = watched_face_code(pictures, len(pictures) / PICTURES_A_SECOND, given.training_seed)
    save_face_code(given.file, code)
    origin = code.origin
    print(
        f'{given.file}: trained on {origin.trained_on}, {origin.caregivers} caregivers '
        f'({", ".join(origin.people) or "herself"}), {origin.trials} candidate sets, '
        f'{origin.seconds:.0f} s of pictures'
    )


if __name__ == '__main__':
    main()
