"""What a person looks like: colours relative to the face, and pictures of turns of the head."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from ja_perception.core.box import Box
from ja_perception.core.person_appearance import SAME_PERSON, KnownPerson, read_signature
from people_in_pictures import DrawnPerson, picture_of

ANNA = DrawnPerson(160.0, clothes=(60, 70, 110), hair=(60, 40, 30))
BELA = DrawnPerson(160.0, clothes=(190, 180, 160), hair=(150, 140, 130))


def signature(person, gain=1.0, quality=95):
    picture = np.clip(gain * picture_of(person).astype(float), 0, 255).astype(np.uint8)
    _, code = cv2.imencode('.jpg', picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    picture = cv2.imdecode(code, cv2.IMREAD_COLOR)
    box = Box(person.u, person.v, person.width, person.width)
    return read_signature(picture, cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), box)


def known(person, looks=(-1.0, -0.5, 0.0, 0.5, 1.0)):
    someone = KnownPerson()
    for _ in range(3):
        for look in looks:
            someone.learn(signature(replace(person, look=look)))
    return someone


def test_the_same_person_in_other_light_and_size_is_no_other():
    anna = known(ANNA)
    assert anna.is_known
    for changed in (ANNA, replace(ANNA, u=130.0, width=45.0), replace(ANNA, v=80.0, look=0.7)):
        assert anna.difference(signature(changed)) < 0.5 * SAME_PERSON
        assert anna.difference(signature(changed, gain=0.6)) < SAME_PERSON
        assert anna.difference(signature(changed, gain=0.8, quality=15)) < SAME_PERSON


def test_another_in_other_clothes_differs_with_the_same_face():
    anna, bela = known(ANNA), known(BELA)
    assert anna.difference(signature(BELA)) > SAME_PERSON
    assert bela.difference(signature(ANNA)) > SAME_PERSON


def test_clothes_out_of_the_image_leave_the_rest_to_decide():
    low = replace(ANNA, v=200.0)
    seen = signature(low)
    assert np.isnan(seen.colours[:3]).all()
    assert not np.isnan(seen.colours[3:]).any()
    assert known(ANNA).difference(seen) < SAME_PERSON


def test_slow_change_is_followed():
    anna = known(ANNA)
    for share in np.linspace(0.0, 1.0, 80):
        mixed = (1 - share) * np.array(ANNA.clothes) + share * np.array(BELA.clothes)
        anna.learn(signature(replace(ANNA, clothes=tuple(mixed.tolist()))))
    assert anna.difference(signature(replace(ANNA, clothes=BELA.clothes))) < SAME_PERSON


def test_nothing_known_differs_from_nothing():
    person = KnownPerson()
    assert not person.is_known
    assert person.difference(signature(ANNA)) == 0.0


@pytest.mark.parametrize('box', [Box(-500.0, -500.0, 60.0, 60.0), Box(160.0, 100.0, 0.4, 0.4)])
def test_a_face_out_of_the_image_or_without_size_gives_no_error(box):
    picture = picture_of(ANNA)
    seen = read_signature(picture, cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), box)
    person = known(ANNA)
    person.learn(seen)
    assert np.isfinite(person.difference(seen))
