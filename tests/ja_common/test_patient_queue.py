"""Images wait for the posture at their stamp, each exactly once and in order."""

import pytest

from ja_common.core.patient_queue import PatientQueue
from ja_common.core.posture import PostureHistory


@pytest.fixture
def postures():
    return PostureHistory()


@pytest.fixture
def images(postures):
    return PatientQueue(postures, patience_s=1.0)


def test_goes_on_with_the_posture_interpolated_at_its_stamp(images, postures):
    postures.record_posture(0, (0.0, 0.0))
    images.queue_item(50, 'a', now_s=0.0)
    assert list(images.pop_ready(calibrated=True, now_s=0.1)) == []
    postures.record_posture(100, (0.2, -0.4))
    ((image, stamp_ns, posture),) = list(images.pop_ready(calibrated=True, now_s=0.2))
    assert (image, stamp_ns) == ('a', 50)
    assert posture.position == pytest.approx([0.1, -0.2])
    assert list(images.pop_ready(calibrated=True, now_s=0.3)) == []


def test_keeps_the_order_of_arrival(images, postures):
    images.queue_item(10, 'a', 0.0)
    images.queue_item(20, 'b', 0.0)
    postures.record_posture(20, (0, 0))
    postures.record_posture(5, (0, 0))
    assert [entry[0] for entry in list(images.pop_ready(True, 0.1))] == ['a', 'b']


def test_waits_for_the_calibration_too(images, postures):
    postures.record_posture(10, (0, 0))
    images.queue_item(10, 'a', 0.0)
    assert list(images.pop_ready(calibrated=False, now_s=0.1)) == []
    assert len(list(images.pop_ready(calibrated=True, now_s=0.2))) == 1


def test_without_any_joint_states_patience_is_spent_once(images):
    images.queue_item(10, 'a', 0.0)
    assert list(images.pop_ready(True, 0.9)) == []
    assert list(images.pop_ready(True, 1.1)) == [('a', 10, None)]
    images.queue_item(20, 'b', 1.2)
    assert list(images.pop_ready(True, 1.2)) == [('b', 20, None)]


def test_first_joint_state_ends_the_impatience(images, postures):
    images.queue_item(10, 'a', 0.0)
    list(images.pop_ready(True, 1.1))
    postures.record_posture(15, (0, 0))
    images.queue_item(20, 'b', 1.2)
    assert list(images.pop_ready(True, 1.3)) == []
    postures.record_posture(20, (0, 0))
    ((_, _, posture),) = images.pop_ready(True, 1.4)
    assert posture is not None


def test_lost_joint_states_let_images_go_on_without_a_posture(images, postures):
    postures.record_posture(10, (0, 0))
    images.queue_item(20, 'a', 0.0)
    assert list(images.pop_ready(True, 0.5)) == []
    assert list(images.pop_ready(True, 1.5)) == [('a', 20, None)]


def test_image_older_than_every_joint_state_does_not_wait(images, postures):
    postures.record_posture(100, (0, 0))
    images.queue_item(50, 'old', 0.0)
    assert list(images.pop_ready(True, 0.0)) == [('old', 50, None)]


def test_uncalibrated_camera_is_waited_for_once(images, postures):
    postures.record_posture(30, (0, 0))
    postures.record_posture(10, (0, 0))
    images.queue_item(10, 'a', 0.0)
    assert len(list(images.pop_ready(False, 1.1))) == 1
    images.queue_item(20, 'b', 1.2)
    assert len(list(images.pop_ready(False, 1.2))) == 1
