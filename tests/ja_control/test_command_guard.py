"""The guard fails closed: no unsafe command passes, and missing input holds the head."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ja_common.core.config import ConfigError
from ja_common.core.health import Level
from ja_control.core.command_guard import CommandGuard, CommandGuardConfig
from ja_control.core.hold import Cause
from ja_control.core.joint_limits import JointLimitsConfig

PERIOD_S = 0.01
LIMITS = JointLimitsConfig(
    pan_min_rad=-1.0,
    pan_max_rad=0.8,
    tilt_min_rad=-0.5,
    tilt_max_rad=0.4,
    soft_margin_rad=0.02,
    max_speed_rad_s=2.0,
    max_acceleration_rad_s2=40.0,
)
CONFIG = CommandGuardConfig(
    dead_zone_rad=0.005,
    stale_after_s=0.5,
    hold_after_s=0.1,
    stall_error_rad=0.1,
    stall_after_s=0.3,
    retry_after_s=1.0,
    outside_rad=0.3,
)


class Rig:
    """A guard, images every third period, and a head that follows its command at once."""

    def __init__(self, posture=(0.0, 0.0), **config):
        self.guard = CommandGuard(LIMITS, replace(CONFIG, **config), PERIOD_S)
        self.now_s = 100.0
        self.posture = np.array(posture)
        self.images = self.joints = True
        self.follows = True
        self.image_age_s = self.joints_age_s = 0.02
        self._tick = 0

    def run(self, seconds, target=None):
        """Return the command of every period."""
        commands = []
        for _ in range(round(seconds / PERIOD_S)):
            self.now_s += PERIOD_S
            if self.joints:
                self.guard.record_joints(self.posture, self.now_s, self.joints_age_s)
            if self.images and self._tick % 3 == 0:
                self.guard.record_image(self.now_s, self.image_age_s)
                if target is not None and self.guard.engaged:
                    self.guard.set_target(target)
            self._tick += 1
            command = self.guard.step(self.now_s)
            if self.follows and command.position is not None:
                self.posture = command.position
            commands.append(command)
        return commands


def causes(commands):
    """Return the causes of holds in their order, each run once; None while moving."""
    found = [None if c.hold is None else c.hold.cause for c in commands]
    return [c for i, c in enumerate(found) if i == 0 or c is not found[i - 1]]


def stopped_after_s(commands):
    """Return the time [s] after which the command no longer moved."""
    moving = [i for i, c in enumerate(commands) if c.velocity.any()]
    return (moving[-1] + 2) * PERIOD_S if moving else 0.0


def test_head_starts_where_it_stands_and_reaches_its_target():
    rig = Rig(posture=(0.3, -0.1))
    commands = rig.run(0.6, target=(-0.4, 0.2))
    assert commands[0].position == pytest.approx((0.3, -0.1))
    assert commands[-1].position == pytest.approx((-0.4, 0.2))
    assert causes(commands) == [None]


def test_nothing_is_sent_before_joint_states_and_an_image_have_come():
    for missing in ('joints', 'images'):
        rig = Rig()
        setattr(rig, missing, False)
        assert all(c.position is None and c.hold.cause is Cause.WAITING for c in rig.run(0.05))
        setattr(rig, missing, True)
        assert rig.run(0.05)[-1].hold is None


@pytest.mark.parametrize('bad', [(math.nan, 0.0), (0.0, math.inf), (0.0,)])
def test_what_is_not_finite_is_refused_and_changes_nothing(bad):
    rig = Rig()
    rig.run(0.3, target=(0.2, 0.1))
    with pytest.raises(ValueError, match='target posture must be two finite numbers'):
        rig.guard.set_target(bad)
    with pytest.raises(ValueError, match='measured posture must be two finite numbers'):
        rig.guard.record_joints(bad, rig.now_s, 0.0)
    assert rig.run(0.05)[-1].position == pytest.approx((0.2, 0.1))


def test_target_within_the_dead_zone_keeps_the_last_one_joint_by_joint():
    rig = Rig()
    rig.run(0.5, target=(0.3, 0.1))
    assert rig.run(0.3, target=(0.304, 0.2))[-1].position == pytest.approx((0.3, 0.2))


def test_target_outside_ends_at_the_soft_margin_and_is_reported():
    command = Rig().run(1.5, target=(3.0, -3.0))[-1]
    assert command.position == pytest.approx((0.78, -0.48))
    assert command.clamped == 'position'


def test_cut_by_speed_and_acceleration_is_reported():
    commands = Rig().run(0.5, target=(0.7, 0.0))
    assert {'acceleration', 'speed', ''} <= {c.clamped for c in commands}


@pytest.mark.parametrize(
    ('fail', 'cause'),
    [
        (dict(images=False), Cause.SILENT),
        (dict(image_age_s=0.6), Cause.STALE_IMAGE),
        (dict(image_age_s=-0.6), Cause.STALE_IMAGE),
        (dict(joints_age_s=0.6), Cause.STALE_JOINTS),
        (dict(joints_age_s=-0.6), Cause.STALE_JOINTS),
    ],
)
def test_missing_or_stale_input_stops_the_head_and_its_return_moves_it_again(fail, cause):
    rig = Rig()
    before = {name: getattr(rig, name) for name in fail}
    moving = rig.run(0.25, target=(0.7, 0.0))
    assert moving[-1].velocity[0] == pytest.approx(2.0)
    vars(rig).update(fail)
    stopping = rig.run(0.4, target=(0.7, 0.0))
    assert stopped_after_s(stopping) <= CONFIG.hold_after_s + 2.0 / 40.0 + 3 * PERIOD_S
    assert stopping[-1].hold.cause is cause
    assert stopping[-1].hold.level is Level.WARN
    vars(rig).update(before)
    assert rig.run(0.5, target=(0.7, 0.0))[-1].position == pytest.approx((0.7, 0.0))


def test_joint_states_that_stop_make_the_head_stop():
    rig = Rig()
    rig.run(0.1, target=(0.7, 0.0))
    rig.joints = False
    assert causes(rig.run(1.0, target=(0.7, 0.0)))[-1] is Cause.STALE_JOINTS


def test_after_a_hold_the_command_starts_at_the_measured_posture():
    rig = Rig()
    rig.run(0.5, target=(0.5, 0.0))
    rig.guard.enable(False)
    held = rig.run(0.2)
    assert held[-1].hold.text == 'disabled'
    rig.follows, rig.posture = False, np.array([-0.2, 0.1])  # turned by hand
    assert rig.run(0.2)[-1].position == pytest.approx((0.5, 0.0)), 'no chase of a turned head'
    rig.guard.enable(True)
    rig.follows = True
    again = rig.run(0.03)
    assert again[0].position == pytest.approx((-0.2, 0.1))


def test_disabling_brakes_it_does_not_jerk():
    rig = Rig()
    rig.run(0.2, target=(0.7, 0.0))
    rig.guard.enable(False)
    velocities = [c.velocity[0] for c in rig.run(0.1)]
    assert np.diff(velocities).min() >= -40.0 * PERIOD_S - 1e-9
    assert velocities[-1] == 0.0


def test_joint_that_does_not_follow_is_a_stall_and_is_tried_again():
    rig = Rig()
    rig.follows = False
    commands = rig.run(0.8, target=(0.5, 0.0))
    stalled = next(i for i, c in enumerate(commands) if c.hold)
    assert stalled * PERIOD_S == pytest.approx(CONFIG.stall_after_s + 0.1, abs=0.1)
    assert commands[stalled].hold.cause is Cause.STALLED
    assert commands[stalled].hold.level is Level.ERROR
    assert commands[-1].position == pytest.approx((0.0, 0.0)), 'no pushing against what blocks it'
    rig.follows = True
    assert rig.run(2.0, target=(0.5, 0.0))[-1].position == pytest.approx((0.5, 0.0))


def test_slow_joint_is_no_stall():
    rig = Rig()
    rig.follows = False
    for _ in range(400):
        command = rig.run(PERIOD_S, target=(0.7, 0.0))[-1]
        rig.posture = rig.posture + np.clip(command.position - rig.posture, -0.0015, 0.0015)
        assert command.hold is None


def test_noise_of_the_encoders_does_not_hide_a_stall():
    rig = Rig()
    rig.follows = False
    rng = np.random.default_rng(0)
    seen = set()
    for _ in range(80):
        rig.posture = rng.normal(0.0, 0.003, 2)
        seen |= {c.hold.cause for c in rig.run(PERIOD_S, target=(0.5, 0.0)) if c.hold}
    assert seen == {Cause.STALLED}


def test_joint_states_that_come_rarely_are_no_stall():
    rig = Rig()
    rig.run(0.1, target=(0.0, 0.0))
    rig.joints = False
    commands = rig.run(0.45, target=(0.7, 0.0))
    assert rig.posture[0] - commands[0].position[0] > CONFIG.stall_error_rad
    assert all(c.hold is None for c in commands), 'the joint states are younger than stale_after_s'
    rig.joints = True
    assert rig.run(0.5, target=(0.7, 0.0))[-1].position == pytest.approx((0.7, 0.0))


def test_latched_fault_waits_for_enable():
    rig = Rig(latch_faults=True)
    rig.run(0.2, target=(0.5, 0.0))
    rig.images = False
    rig.run(0.3)
    rig.images = True
    held = rig.run(0.5, target=(0.5, 0.0))[-1]
    assert held.hold.cause is Cause.SILENT
    assert 'latched until gate/enable is called' in held.hold.text
    rig.guard.enable(True)
    assert rig.run(0.5, target=(0.5, 0.0))[-1].position == pytest.approx((0.5, 0.0))


def test_drooping_head_is_brought_back_in_gently_and_never_farther_out():
    rig = Rig(posture=(0.0, 0.6))
    tilts = [c.position[1] for c in rig.run(0.5)]
    assert tilts[0] == pytest.approx(0.6, abs=0.01)
    assert max(tilts) <= 0.6
    assert tilts[-1] == pytest.approx(0.38)


def test_head_far_outside_is_not_moved():
    rig = Rig(posture=(1.4, 0.0))
    command = rig.run(0.2, target=(0.0, 0.0))[-1]
    assert command.position is None
    assert command.hold.cause is Cause.OUTSIDE
    assert command.hold.level is Level.ERROR
    rig.posture = np.array([0.5, 0.0])
    assert rig.run(0.4, target=(0.0, 0.0))[-1].position == pytest.approx((0.0, 0.0))


def test_clock_that_runs_back_discards_the_inputs():
    rig = Rig()
    rig.run(0.2, target=(0.7, 0.0))
    rig.now_s -= 50.0
    rig.images = rig.joints = False
    commands = rig.run(0.2)
    assert stopped_after_s(commands) <= 0.06
    assert commands[-1].hold.cause is Cause.WAITING


def test_new_limits_wait_until_the_old_ones_have_stopped_the_head():
    rig = Rig()
    rig.run(0.2, target=(0.7, 0.0))
    rig.guard.set_limits(replace(LIMITS, max_acceleration_rad_s2=1.0, pan_max_rad=0.1))
    commands = rig.run(3.0, target=(0.7, 0.0))
    velocities = [c.velocity[0] for c in commands]
    assert min(np.diff(velocities[:6])) == pytest.approx(-0.4), 'braked by the old limit'
    assert np.abs(np.diff(velocities[6:])).max() <= 1.0 * PERIOD_S + 1e-9
    assert commands[-1].position[0] == pytest.approx(0.08)


def test_while_another_node_commands_the_head_it_brakes_and_then_sends_nothing():
    rig = Rig()
    rig.run(0.2, target=(0.7, 0.0))
    rig.guard.other_commander = '/other publishes'
    commands = rig.run(0.2, target=(0.7, 0.0))
    assert {c.hold.level for c in commands} == {Level.ERROR}
    assert {c.hold.text for c in commands} == {'/other publishes'}
    sent = [c for c in commands if c.position is not None]
    assert len(sent) * PERIOD_S == pytest.approx(2.0 / 40.0, abs=2 * PERIOD_S)
    assert not sent[-1].velocity.any(), 'the last command is at rest'
    assert all(c.position is None for c in commands[len(sent) :])
    rig.posture = np.array([-0.3, 0.1])  # turned by the other
    rig.guard.other_commander = ''
    again = rig.run(0.5, target=(0.5, 0.0))
    assert again[0].position == pytest.approx((-0.3, 0.1)), 'no jump'
    assert again[-1].position == pytest.approx((0.5, 0.0))


@pytest.mark.parametrize('held', ['disabled', 'blocked', 'waiting', 'latched'])
def test_another_commander_is_an_error_and_silences_whatever_else_holds_the_head(held):
    rig = Rig(latch_faults=True)
    if held != 'waiting':
        rig.run(0.2, target=(0.5, 0.0))
    if held == 'disabled':
        rig.guard.enable(False)
    elif held == 'blocked':
        rig.guard.blocked = 'a reason'
    elif held == 'latched':
        rig.images = False
        rig.run(0.3)
        rig.images = True
    rig.guard.other_commander = '/other publishes'
    command = rig.run(0.2)[-1]
    assert (command.position, command.hold.level) == (None, Level.ERROR)
    assert command.hold.cause is Cause.OTHER_COMMANDER


NOT_FINITE = (math.nan, math.inf, -math.inf)


@pytest.mark.parametrize('bad', NOT_FINITE)
@pytest.mark.parametrize('what', ['image_age_s', 'joints_age_s', 'now_s'])
def test_a_time_that_is_not_finite_is_not_fresh(what, bad):
    """From the start it moves nothing; later it stops the head; and its end lets it move again."""
    rig = Rig()
    good = getattr(rig, what)
    setattr(rig, what, bad)
    assert all(c.position is None and c.hold for c in rig.run(0.2, target=(0.7, 0.0)))
    setattr(rig, what, good)
    rig.run(0.2, target=(0.7, 0.0))
    setattr(rig, what, bad)
    stopping = rig.run(0.4, target=(0.7, 0.0))
    assert stopping[-1].hold is not None
    assert stopped_after_s(stopping) <= 2.0 / 40.0 + 4 * PERIOD_S
    setattr(rig, what, good + 1.0 if what == 'now_s' else good)
    assert rig.run(0.6, target=(0.7, 0.0))[-1].position == pytest.approx((0.7, 0.0))


@given(st.sampled_from(NOT_FINITE), st.sampled_from(['image', 'joints', 'step']), st.booleans())
def test_one_clock_reading_that_is_not_finite_moves_nothing_until_all_inputs_are_new(
    bad, where, with_age
):
    rig = Rig()
    rig.run(0.3, target=(0.2, 0.0))
    age_s = bad if with_age else 0.0
    if where == 'image':
        rig.guard.record_image(bad, age_s)
    elif where == 'joints':
        rig.guard.record_joints(rig.posture, bad, age_s)
    else:
        rig.guard.step(bad)
    rig.images = rig.joints = False
    assert all(c.hold is not None for c in rig.run(0.05))
    rig.images = True
    assert all(c.hold is not None for c in rig.run(0.05))
    rig.joints = True
    assert rig.run(0.2)[-1].hold is None


@pytest.mark.parametrize('period_s', [*NOT_FINITE, 0.0, -0.01])
def test_a_period_that_is_no_time_is_refused(period_s):
    with pytest.raises(ValueError, match='control period'):
        CommandGuard(LIMITS, CONFIG, period_s)


@pytest.mark.parametrize('config_class', [JointLimitsConfig, CommandGuardConfig])
def test_a_limit_that_is_not_finite_is_refused(config_class):
    for each in fields(config_class):
        for bad in NOT_FINITE if isinstance(each.default, float) else ():
            with pytest.raises(ConfigError, match=each.name):
                config_class(**{each.name: bad})


# Actions on a guard and on the world around it.
anything = st.floats(allow_nan=True, allow_infinity=True)
angle = st.one_of(st.floats(-2.0, 2.0), anything)
pair = st.tuples(angle, angle)
seconds = st.one_of(st.floats(-1.0, 1.0), anything)
no_fault = st.tuples(st.just('no_fault'), st.tuples(st.floats(-2, 2), st.floats(-2, 2)))
action = st.one_of(
    no_fault, no_fault, no_fault, no_fault,
    st.tuples(st.just('target'), pair),
    st.tuples(st.just('joints'), pair, seconds),
    st.tuples(st.just('image'), seconds),
    st.tuples(st.just('steps'), st.integers(1, 12)),
    st.tuples(st.just('clock'), st.floats(-5.0, 5.0)),
    st.tuples(st.just('bad_clock'), st.sampled_from(NOT_FINITE)),
    st.tuples(st.just('enable'), st.booleans()),
    st.tuples(st.just('restart_guard')),
    st.tuples(st.just('replace')),
    st.tuples(st.just('block'), st.sampled_from(['', 'waiting'])),
    st.tuples(st.just('other'), st.sampled_from(['', '/other publishes'])),
    st.tuples(
        st.just('limits'), st.floats(0.1, 4.0), st.floats(1.0, 100.0), st.floats(0.3, 1.5)
    ),
)  # fmt: skip


class History:
    """Applies a history of actions to a guard, and keeps every command for `check_commands`."""

    def __init__(self):
        self.now_s = 0.0
        self.measured = None
        self.limits = [LIMITS]
        self.rows = []
        self._replace()

    def do(self, what, *arguments):
        getattr(self, f'_{what}')(*arguments)

    def _replace(self):
        self.guard = CommandGuard(self.limits[-1], replace(CONFIG, stall_after_s=0.06), PERIOD_S)
        self.position = None

    def _target(self, target):
        self._try(self.guard.set_target, target)

    def _joints(self, posture, age_s):
        if self._try(self.guard.record_joints, posture, self.now_s, age_s):
            self.measured = posture

    def _image(self, age_s):
        self.guard.record_image(self.now_s, age_s)

    def _no_fault(self, target):
        """Run some periods without a fault: the head follows, and images come."""
        self.guard.enable(True)
        self.guard.blocked = self.guard.other_commander = ''
        for _ in range(3):
            if self.position is not None:
                self._joints(tuple(self.position), 0.0)
            elif self.measured is None:
                self._joints((0.1, 0.0), 0.0)
            else:
                self._joints(self.measured, 0.0)
            self._image(0.0)
            if self.guard.engaged:
                self._target(target)
            self._steps(3)

    def _clock(self, seconds):
        self.now_s += seconds

    def _bad_clock(self, now_s):
        command = self.guard.step(now_s)
        self.position = command.position
        self.rows.append((command, self.measured, len(self.limits)))

    def _enable(self, enabled):
        self.guard.enable(enabled)

    def _restart_guard(self):
        self.guard.restart()

    def _block(self, text):
        self.guard.blocked = text

    def _other(self, text):
        self.guard.other_commander = text

    def _limits(self, speed, acceleration, room):
        changed = replace(
            LIMITS,
            max_speed_rad_s=speed,
            max_acceleration_rad_s2=acceleration,
            pan_min_rad=-room,
            pan_max_rad=room,
        )
        self.guard.set_limits(changed)
        self.limits.append(changed)

    def _steps(self, count):
        for _ in range(count):
            self.now_s += PERIOD_S
            command = self.guard.step(self.now_s)
            self.position = command.position
            self.rows.append((command, self.measured, len(self.limits)))

    def _try(self, function, *arguments):
        try:
            function(*arguments)
        except ValueError:
            return False
        return True


NOWHERE = np.full(2, np.nan)
OTHER = Cause.OTHER_COMMANDER


def check_commands(history):
    """Check every command of a history against every limit, all at once."""
    commands, measured, counts = zip(*history.rows, strict=True)
    sent = np.array([c.position is not None for c in commands])
    assert all(c.hold is not None for c in commands if c.position is None)
    position = np.array([NOWHERE if c.position is None else c.position for c in commands])
    velocity = np.array([c.velocity for c in commands])
    measured = np.array([NOWHERE if m is None else m for m in measured])
    free = np.array([c.hold is None for c in commands])
    braking = np.array(
        [c.hold is not None and c.hold.cause is not Cause.STALLED for c in commands]
    )
    assert np.isfinite(position[sent]).all()
    assert np.isfinite(velocity).all()

    # The limits in force: those of now or, while they brake the head, older ones.
    now = np.array(counts) - 1
    speed = np.maximum.accumulate([c.max_speed_rad_s for c in history.limits])[now, None]
    accelerations = [c.max_acceleration_rad_s2 for c in history.limits]
    step = PERIOD_S * np.maximum.accumulate(accelerations)[now, None]
    low = np.minimum.accumulate([(c.pan_min_rad, c.tilt_min_rad) for c in history.limits])[now]
    high = np.maximum.accumulate([(c.pan_max_rad, c.tilt_max_rad) for c in history.limits])[now]
    assert np.all(np.abs(velocity) <= speed + 1e-9)
    outside = np.maximum(np.maximum(low - position, position - high), 0.0)
    assert np.all(outside[sent] <= CONFIG.outside_rad + 1e-9)

    def close(a, b):
        return np.all(np.abs(a - b) <= 1e-9, axis=1)

    # Each command either goes on from the last one, or starts the head.
    continues = close(position[1:], position[:-1] + velocity[1:] * PERIOD_S)
    was_at_rest = ~velocity[:-1].any(axis=1)
    starts = sent[1:] & (~sent[:-1] | (was_at_rest & ~continues))
    starts = np.concatenate([sent[:1], starts])
    # A start is at rest, at the measured posture, and never during a hold.
    assert np.all(np.abs(velocity[starts]) <= step[starts] + 1e-9)
    assert close(position, measured + velocity * PERIOD_S)[starts].all()
    assert free[starts].all()
    # All others go on, within the acceleration limit, and never farther outside than before.
    on = (sent & ~starts)[1:]
    assert continues[on].all()
    assert np.all(np.abs(np.diff(velocity, axis=0)) <= step[1:] + 1e-9, axis=1)[on].all()
    was = np.maximum(np.maximum(low[1:] - position[:-1], position[:-1] - high[1:]), 0.0)
    assert np.all(outside[1:] <= was + 1e-9, axis=1)[on].all()
    others = np.array([c.hold is not None and c.hold.cause is OTHER for c in commands])
    at_rest = others[1:] & ~velocity[:-1].any(axis=1)
    assert not sent[1:][at_rest].any(), 'nothing is sent while another node commands the head'
    slower = np.all(np.abs(velocity[1:]) <= np.abs(velocity[:-1]), axis=1)
    assert slower[on & braking[1:]].all(), 'a hold brakes'


def any_history(actions):
    history = History()
    history.do('steps', 1)
    for each in actions:
        history.do(*each)
        history.do('steps', 1)
    check_commands(history)
    return history


@settings(max_examples=300, deadline=None)
@given(st.lists(action, max_size=40))
def test_no_history_of_inputs_leaves_a_limit(actions):
    any_history(actions)


ODD = (np.nan, np.inf, -np.inf, 0.0, 5e-324, 1e300, -1e300)


def random_action(rng):
    """As `action` draws them, at a hundredth of the cost."""

    def number(reach):
        return float(rng.choice(ODD) if rng.random() < 0.1 else rng.uniform(-reach, reach))

    kinds = {
        'no_fault': lambda: (tuple(rng.uniform(-2.0, 2.0, 2)),),
        'target': lambda: ((number(2.0), number(2.0)),),
        'joints': lambda: ((number(2.0), number(2.0)), number(1.0)),
        'image': lambda: (number(1.0),),
        'steps': lambda: (int(rng.integers(1, 13)),),
        'clock': lambda: (rng.uniform(-5.0, 5.0),),
        'bad_clock': lambda: (float(rng.choice(NOT_FINITE)),),
        'enable': lambda: (bool(rng.integers(2)),),
        'restart_guard': tuple,
        'replace': tuple,
        'block': lambda: (('', 'waiting')[rng.integers(2)],),
        'other': lambda: (('', '/other publishes')[rng.integers(2)],),
        'limits': lambda: tuple(rng.uniform((0.1, 1.0, 0.3), (4.0, 100.0, 1.5))),
    }
    kind = 'no_fault' if rng.random() < 0.3 else list(kinds)[rng.integers(len(kinds))]
    return (kind, *kinds[kind]())


@pytest.mark.slow
def test_no_history_of_inputs_leaves_a_limit_in_a_hundred_thousand():
    rng = np.random.default_rng(0)
    moved, held = 0, set()
    for _ in range(100_000):
        history = any_history([random_action(rng) for _ in range(rng.integers(1, 16))])
        moved += sum(bool(command.velocity.any()) for command, *_ in history.rows)
        held |= {command.hold.cause for command, *_ in history.rows if command.hold}
    assert moved > 100_000, 'histories in which nothing moves prove nothing'
    assert held == set(Cause)


def test_the_check_finds_a_jump():
    """The test above is only as good as its check."""
    history = any_history([('no_fault', (0.5, 0.1))] * 5)
    for index, change in ((-1, 0.02), (3, np.nan)):
        rows = list(history.rows)
        command, *more = rows[index]
        history.rows[index] = (replace(command, position=command.position + change), *more)
        with pytest.raises(AssertionError):
            check_commands(history)
        history.rows = rows
