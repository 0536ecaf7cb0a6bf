"""Which detection is the target, and which the caregiver."""

import pytest

from ja_common.core.detection import Detection, Kind, caregiver_face, most_salient, objects


def seen(kind, score, x=0.0):
    return Detection(kind, x, 0.0, 0.0, 0.0, 10.0, 10.0, score)


def test_target_is_the_object_of_the_highest_score_whatever_faces_score():
    faint, bright = seen(Kind.OBJECT, 0.2), seen(Kind.OBJECT, 0.9)
    everything = [seen(Kind.FACE, 5.0), faint, bright]
    assert most_salient(everything) is bright
    assert objects(everything) == [faint, bright]
    assert most_salient([seen(Kind.FACE, 1.0)]) is None


def test_caregiver_is_the_first_face():
    first = seen(Kind.FACE, 0.1)
    assert caregiver_face([seen(Kind.OBJECT, 1.0), first, seen(Kind.FACE, 0.9)]) is first
    assert caregiver_face([seen(Kind.OBJECT, 1.0)]) is None


def test_ray():
    assert Detection(Kind.OBJECT, 0.1, -0.2, 0, 0, 1, 1, 1).ray == pytest.approx((0.1, -0.2))
