"""Looks with all their pictures, and no label of what she attends to."""

from dataclasses import replace
from itertools import islice

import numpy as np

from ja_experiments.datasets.watching import WatchedLook, watch
from ja_sim.core.scene import load_scene


def test_a_watched_look_has_every_picture_and_every_object_but_no_label():
    scene = load_scene('default')
    scene = replace(scene, caregiver=replace(scene.caregiver, identity='ivo'))
    looks = list(islice(watch(scene, 30), 2))
    for each in looks:
        assert each.pictures.shape[1:] == (30, 25)
        assert len(each.pictures) >= 5
        np.testing.assert_array_equal(each.pictures[-1], each.look.face)
        assert each.objects.shape == (scene.objects.count, 2)
    assert WatchedLook._fields == ('pictures', 'look', 'objects')
    assert not np.array_equal(looks[0].look.face, looks[1].look.face)
