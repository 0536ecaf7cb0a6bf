"""Images wait for the posture at their stamp, each exactly once and in order."""

import pytest

from ja_common.core.posture import PostureHistory
from ja_perception.core.waiting_images import WaitingImages


@pytest.fixture
def postures():
    return PostureHistory()


@pytest.fixture
def images(postures):
    return WaitingImages(postures, patience_s=1.0)


def test_goes_on_with_the_posture_interpolated_at_its_stamp(images, postures):
    postures.add(0, (0.0, 0.0))
    images.add(50, 'a', now_s=0.0)
    assert images.ready(calibrated=True, now_s=0.1) == []
    postures.add(100, (0.2, -0.4))
    ((image, stamp_ns, posture),) = images.ready(calibrated=True, now_s=0.2)
    assert (image, stamp_ns) == ('a', 50)
    assert posture.position == pytest.approx([0.1, -0.2])
    assert images.ready(calibrated=True, now_s=0.3) == []


def test_keeps_the_order_of_arrival(images, postures):
    images.add(10, 'a', 0.0)
    images.add(20, 'b', 0.0)
    postures.add(20, (0, 0))
    postures.add(5, (0, 0))
    assert [entry[0] for entry in images.ready(True, 0.1)] == ['a', 'b']


def test_waits_for_the_calibration_too(images, postures):
    postures.add(10, (0, 0))
    images.add(10, 'a', 0.0)
    assert images.ready(calibrated=False, now_s=0.1) == []
    assert len(images.ready(calibrated=True, now_s=0.2)) == 1


def test_without_any_joint_states_patience_is_spent_once(images):
    images.add(10, 'a', 0.0)
    assert images.ready(True, 0.9) == []
    assert images.ready(True, 1.1) == [('a', 10, None)]
    images.add(20, 'b', 1.2)
    assert images.ready(True, 1.2) == [('b', 20, None)]


def test_first_joint_state_ends_the_impatience(images, postures):
    images.add(10, 'a', 0.0)
    images.ready(True, 1.1)
    postures.add(15, (0, 0))
    images.add(20, 'b', 1.2)
    assert images.ready(True, 1.3) == []
    postures.add(20, (0, 0))
    assert images.ready(True, 1.4)[0][2] is not None


def test_lost_joint_states_let_images_go_on_without_a_posture(images, postures):
    postures.add(10, (0, 0))
    images.add(20, 'a', 0.0)
    assert images.ready(True, 0.5) == []
    assert images.ready(True, 1.5) == [('a', 20, None)]


def test_image_older_than_every_joint_state_does_not_wait(images, postures):
    postures.add(100, (0, 0))
    images.add(50, 'old', 0.0)
    assert images.ready(True, 0.0) == [('old', 50, None)]


def test_uncalibrated_camera_is_waited_for_once(images, postures):
    postures.add(30, (0, 0))
    postures.add(10, (0, 0))
    images.add(10, 'a', 0.0)
    assert len(images.ready(False, 1.1)) == 1
    images.add(20, 'b', 1.2)
    assert len(images.ready(False, 1.2)) == 1
