"""`sim`: a camera and a head on topics, one step for each command that answers the last image."""

import math
import subprocess
import sys
import time

import numpy as np
import pytest
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import ConfigError
from ja_common.image_codec import decode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.time_codec import to_ns
from ja_common.topics import (
    CAMERA_INFO,
    CLOCK,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    SIM_TRUTH,
)
from ja_sim.sim_node import SimNode
from ja_sim.truth_codec import decode_truth
from node_bench import joint_state
from ros_testing import PATIENCE_S

PERIOD_NS = 100_000_000
SIZE = {'image_width': 64, 'image_height': 48}
RECEIVED = [IMAGE, CAMERA_INFO, JOINT_STATES, CLOCK, SIM_TRUTH]


def stamp(message):
    return to_ns(message.header.stamp)


class Rig:
    """What moves the simulated head: it answers images with commands."""

    def __init__(self, bench):
        self.bench = bench
        bench.wait(lambda: bench.messages(IMAGE))

    @property
    def image(self):
        return self.bench.messages(IMAGE)[-1]

    def command(self, *posture, stamp_ns=None):
        at = stamp(self.image) if stamp_ns is None else stamp_ns
        self.bench.publish(JOINT_COMMANDS, joint_state(at, *posture))

    def step(self, *posture):
        """Answer the last image; return the one that follows."""
        before = stamp(self.image)
        self.command(*posture)
        self.bench.wait(lambda: stamp(self.image) > before)
        return self.image

    def at_image(self, topic):
        """Return the message of another topic with the stamp of the last image."""

        def found():
            return [m for m in self.bench.messages(topic) if stamp(m) == stamp(self.image)]

        self.bench.wait(found)
        return found()[-1]


@pytest.fixture
def make_rig(make_bench):
    def make(**parameters):
        parameters = {'scene': 'easy', 'resend_after_s': 0.2, **SIZE, **parameters}
        return Rig(make_bench(SimNode, [JOINT_COMMANDS], RECEIVED, **parameters))

    return make


def test_every_image_comes_with_clock_posture_intrinsics_and_truth(make_rig):
    rig = make_rig()
    rig.step(0.0, 0.0)
    assert decode_image(rig.image).shape == (48, 64, 3)
    info = rig.at_image(CAMERA_INFO)
    assert (info.width, info.height) == (64, 48)
    assert info.header == rig.image.header
    half_view = math.atan(32 / info.k[0])
    assert math.degrees(half_view) == pytest.approx(18.0, abs=0.1), "the paper's view"
    state = rig.at_image(JOINT_STATES)
    assert list(state.name) == ['pan', 'tilt']
    assert len(state.velocity) == 2
    assert rig.image.header.frame_id == info.header.frame_id == 'camera_optical_frame'
    assert rig.at_image(SIM_TRUTH).header.frame_id == 'base_link', 'where its positions are'
    assert state.header.frame_id == ''
    truth = decode_truth(rig.at_image(SIM_TRUTH))
    assert truth.directions.shape == (3, 2)
    assert to_ns(rig.bench.messages(CLOCK)[-1].clock) == stamp(rig.image)


def test_head_obeys_and_time_passes_only_with_a_command_for_the_last_image(make_rig):
    rig = make_rig(resend_after_s=0.05)
    first = stamp(rig.image)
    rig.command(0.2, 0.1, stamp_ns=first - PERIOD_NS)  # an answer to another image
    rig.bench.wait(lambda: rig.bench.received(JOINT_COMMANDS) == 1)
    assert stamp(rig.bench.next(IMAGE, count=2)) == first
    for _ in range(6):
        rig.step(0.1, -0.05)
    assert stamp(rig.image) == first + 6 * PERIOD_NS
    posture = JointCodec(JointConfig()).decode(rig.at_image(JOINT_STATES))
    assert posture == pytest.approx((0.1, -0.05), abs=0.01)


def test_image_that_is_not_answered_is_sent_again_unchanged(make_rig):
    rig = make_rig(resend_after_s=0.05)
    rig.bench.next(IMAGE, count=2)
    images = rig.bench.messages(IMAGE)
    assert all(image == images[0] for image in images)
    assert 'sending it again' not in rig.bench.complaint(), 'a robot that starts has lost nothing'
    rig.step(0.0, 0.0)
    rig.bench.next(IMAGE, count=2)
    rig.bench.wait_for_complaint('no command came for the last image')
    rig.step(0.0, 0.0)


def run(rig, postures=((0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.0))):
    """Return the pictures seen on a course of commands."""
    return [bytes(rig.step(*posture).data) for posture in postures]


def pan(rig):
    return JointCodec(JointConfig()).decode(rig.at_image(JOINT_STATES))[0]


def test_drawing_ahead_shows_what_a_command_does_one_picture_later(make_rig):
    rig = make_rig(draw_ahead=True)
    first = stamp(rig.image)
    rig.step(0.2, 0.0)
    assert pan(rig) == pytest.approx(0.0, abs=0.01), 'it was drawn before the command came'
    rig.step(-0.1, 0.0)
    assert pan(rig) == pytest.approx(0.2, abs=0.01)
    rig.step(-0.1, 0.0)
    assert pan(rig) == pytest.approx(-0.1, abs=0.01)
    assert stamp(rig.image) == first + 3 * PERIOD_NS, 'none is left out'


def test_nothing_of_the_world_before_a_reset_is_left_when_drawing_ahead(make_rig):
    rig = make_rig(draw_ahead=True, seed=3)
    pictures = run(rig)
    rig.step(0.3, 0.0)
    last = stamp(rig.image)
    assert rig.bench.call(Trigger, 'sim/reset').success
    rig.bench.wait(lambda: stamp(rig.image) > last)
    assert run(rig) == pictures
    assert rig.bench.set_parameter('objects', 1).successful
    rig.bench.wait(lambda: len(decode_truth(rig.at_image(SIM_TRUTH)).directions) == 1)


def test_same_seed_and_commands_give_the_same_pictures_also_after_a_reset(make_rig):
    rig = make_rig(seed=3)
    pictures, last = run(rig), stamp(rig.image)
    assert rig.bench.call(Trigger, 'sim/reset').success
    rig.bench.wait(lambda: stamp(rig.image) > last)
    assert run(rig) == pictures
    assert stamp(rig.image) > last, 'the time of the graph never goes back'
    rig.bench.close()

    again = make_rig(seed=3)
    assert run(again) == pictures
    again.bench.close()

    assert run(make_rig(seed=4)) != pictures


def test_encoders_may_be_read_several_times_an_image(make_rig):
    rig = make_rig(joint_states_per_image=4)
    rig.step(0.1, 0.0)
    heard = rig.bench.messages(JOINT_STATES)
    for _ in range(10):  # sensors are heard best-effort: on a busy machine some get lost
        before = stamp(rig.image)
        rig.step(0.1, 0.0)
        rig.bench.wait(lambda: stamp(heard[-1]) == stamp(rig.image))
        stamps = {stamp(message) for message in heard if stamp(message) > before}
        wanted = {before + i * PERIOD_NS // 4 for i in (1, 2, 3, 4)}
        assert stamps <= wanted
        if stamps == wanted:
            return
    pytest.fail('never were four joint states heard of one image')


def test_real_time_needs_no_command(make_rig):
    rig = make_rig(lockstep=False, real_time_factor=5.0)
    rig.bench.next(CAMERA_INFO, count=3)
    steps = np.diff(sorted({stamp(message) for message in rig.bench.messages(SIM_TRUTH)}))
    assert set(steps) == {PERIOD_NS}
    rig.command(0.1, 0.0, stamp_ns=1)  # whatever its stamp

    def arrived():
        return rig.bench.messages(JOINT_STATES)[-1].position[0] == pytest.approx(0.1, abs=0.01)

    rig.bench.wait(arrived)


def test_in_real_time_the_clock_passes_between_the_images(make_rig):
    rig = make_rig(lockstep=False, camera_rate_hz=2.0, resend_after_s=0.05)

    def times():
        return [to_ns(message.clock) for message in rig.bench.messages(CLOCK)]

    def between_images():
        images = {stamp(message) for message in rig.bench.messages(IMAGE)}
        return set(times()) - images

    rig.bench.wait(lambda: len(rig.bench.messages(CAMERA_INFO)) > 3 and len(between_images()) > 20)
    assert rig.bench.call(SetBool, 'sim/pause', data=True).success
    rig.bench.next(IMAGE, count=2)  # sent again, with its own older stamp
    assert times() == sorted(times()), 'time never goes back'


def test_in_a_pause_time_stands_still_but_for_single_steps(make_rig):
    rig = make_rig(resend_after_s=0.05)
    assert not rig.bench.call(Trigger, 'sim/step').success, 'it runs'
    assert rig.bench.call(SetBool, 'sim/pause', data=True).success
    first = stamp(rig.image)
    rig.command(0.0, 0.0)
    rig.bench.wait(lambda: rig.bench.received(JOINT_COMMANDS) == 1)
    assert stamp(rig.bench.next(IMAGE, count=2)) == first
    assert rig.bench.call(Trigger, 'sim/step').success
    rig.bench.wait(lambda: stamp(rig.image) == first + PERIOD_NS)
    rig.command(0.0, 0.0)
    rig.bench.wait(lambda: rig.bench.received(JOINT_COMMANDS) == 2)
    assert rig.bench.call(SetBool, 'sim/pause', data=False).success
    rig.bench.wait(lambda: stamp(rig.image) == first + 2 * PERIOD_NS)


def test_a_set_speed_holds_the_lockstep_back(make_rig):
    rig = make_rig()
    assert rig.bench.set_parameter('real_time_factor', 0.5).successful
    rig.step(0.0, 0.0)
    start = time.monotonic()
    for _ in range(3):
        rig.step(0.0, 0.0)
    assert time.monotonic() - start > 0.35, 'at least two whole periods of 0.2 s'
    assert rig.bench.set_parameter('real_time_factor', 0.0).successful
    assert not rig.bench.set_parameter('real_time_factor', -1.0).successful


def test_objects_can_be_counted_anew_and_rearranged(make_rig):
    rig = make_rig()
    assert len(decode_truth(rig.at_image(SIM_TRUTH)).directions) == 3
    first = stamp(rig.image)
    assert rig.bench.set_parameter('objects', 5).successful
    rig.bench.wait(lambda: stamp(rig.image) > first)
    before = decode_truth(rig.at_image(SIM_TRUTH)).directions
    assert before.shape == (5, 2)
    assert rig.bench.call(Trigger, 'sim/rearrange').success
    rig.step(0.0, 0.0)
    after = decode_truth(rig.at_image(SIM_TRUTH)).directions
    assert np.all(np.abs(after - before).max(axis=1) > 1e-3)
    rig.bench.set_parameter('objects', 0)
    rig.bench.wait(lambda: len(decode_truth(rig.at_image(SIM_TRUTH)).directions) == 3)


def test_broken_command_is_one_clear_error_and_moves_nothing(make_rig):
    rig = make_rig()
    first = stamp(rig.image)
    for posture, text in (
        ((math.nan, 0.0), '/joint_commands: position of'),
        ((0.1,), '/joint_commands: 1 numbers in position for 2 names'),
        ((), '/joint_commands: a command names no joints'),
    ):
        rig.command(*posture)
        rig.bench.wait_for_complaint(text)
    assert stamp(rig.image) == first
    rig.step(0.0, 0.0)


@pytest.mark.parametrize(
    ('parameters', 'text'),
    [
        ({'scene': 'nowhere'}, "no scene 'nowhere': the package has bare_room, default, easy"),
        ({'image_width': 0}, 'image_width'),
        ({'camera_rate_hz': 'fast'}, "camera_rate_hz = 'fast' is a str"),
    ],
)
def test_world_that_cannot_be_made_is_one_clear_error(ros_context, parameters, text):
    overrides = [Parameter(name, value=value) for name, value in parameters.items()]
    with pytest.raises(ConfigError, match=text):
        SimNode(context=ros_context, parameter_overrides=overrides)


def test_a_program_that_ends_without_destroying_the_node_ends_quietly(domain):
    program = 'import rclpy\nfrom ja_sim.sim_node import SimNode\nrclpy.init()\nnode = SimNode()\n'
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert done.returncode == 0
    assert 'Traceback' not in done.stderr
