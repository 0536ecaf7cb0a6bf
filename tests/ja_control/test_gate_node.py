"""`gate`: one command for every complete set of proposals; all else holds the head."""

import math
import time
from contextlib import ExitStack
from functools import partial

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import Point, PointStamped
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import ConfigError
from ja_common.core.health import Level
from ja_common.point_cloud_codec import encode_columns
from ja_common.private_context import private_context
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    CLOCK,
    EVIDENCE,
    FACE_DELTA,
    FIXATION,
    FORWARD_COMMANDS,
    GATE_STATUS,
    GLANCE_DELTA,
    INTERRUPTED,
    JOINT_COMMANDS,
    JOINT_STATES,
    JOINT_TRAJECTORY,
    LM_DELTA,
    LOOK_AT,
    ROBOT_DESCRIPTION,
    VF_DELTA,
)
from ja_control.gate_node import GateNode
from node_bench import header, joint_state

PERIOD_NS = 100_000_000
PROPOSALS = (VF_DELTA, FACE_DELTA, LM_DELTA, GLANCE_DELTA, FIXATION)
PUBLISHES = (*PROPOSALS, EVIDENCE, JOINT_STATES, CLOCK, LOOK_AT)
FACE_RIGHT = {FACE_DELTA: (-0.5, 0.0)}
SPEED = 2.0  # the gate's default [rad/s]


def point_stamped(point, frame, stamp_ns):
    x, y, z = point
    return PointStamped(header=header(stamp_ns, frame), point=Point(x=x, y=y, z=z))


class Graph:
    """The rest of the graph around a gate: a clock, a head, and the proposals of the others."""

    def __init__(self, bench):
        self.bench = bench
        self.stamp_ns = 10**9
        self.pan = 0.0
        bench.wait(lambda: bench.peer.count_subscribers('/clock'))

    def publish_proposals(self, proposals, stamp_ns=None, without=(), **evidence):
        """Publish all topics of one image; those not in `proposals` carry no proposal."""
        stamp_ns = self.stamp_ns if stamp_ns is None else stamp_ns
        evidence = {'log_evidence': 0.0, **evidence}
        columns = {name: [value] for name, value in evidence.items()}
        self.bench.publish(EVIDENCE, encode_columns(header(stamp_ns), columns))
        for topic in PROPOSALS:
            if topic not in without:
                self.bench.publish(topic, joint_state(stamp_ns, *proposals.get(topic, ())))

    def image(self, proposals=FACE_RIGHT, age_s=0.0, follow=True, **evidence):
        """Publish the next image; return its command, which the head follows at once."""
        self.stamp_ns += PERIOD_NS
        self.set_clock(self.stamp_ns + int(age_s * 1e9))
        self.bench.publish_posture(self.stamp_ns, self.pan)
        self.publish_proposals(proposals, **evidence)
        command = self.answer()
        if follow:
            self.pan = command.position[0]
        return command

    def answer(self):
        """Return the command that carries the stamp of the last image."""
        wanted = header(self.stamp_ns, '')
        commands = self.bench.messages(JOINT_COMMANDS)
        self.bench.wait(lambda: any(command.header == wanted for command in commands))
        return next(command for command in reversed(commands) if command.header == wanted)

    def set_clock(self, now_ns):
        """Set /clock, and wait until the gate reads it."""
        clock = self.bench.node.get_clock()

        def publish_and_read():
            self.bench.publish(CLOCK, Clock(clock=to_time(now_ns)))
            return clock.now().nanoseconds == now_ns

        self.bench.wait(publish_and_read)

    def look_at(self, *point, frame='base_link', stamp_ns=None):
        """Publish a point to look at, and wait until the gate has it."""
        stamp_ns = self.stamp_ns if stamp_ns is None else stamp_ns
        before = self.bench.received(LOOK_AT)
        self.bench.publish(LOOK_AT, point_stamped(point, frame, stamp_ns))
        self.bench.wait(lambda: self.bench.received(LOOK_AT) > before)

    def phase(self):
        return self.status()[1]['phase']

    def status(self):
        """Return the status of the last command, and its values."""
        messages = self.bench.messages
        self.bench.wait(lambda: len(messages(GATE_STATUS)) >= len(messages(JOINT_COMMANDS)))
        status = messages(GATE_STATUS)[-1]
        return status, {value.key: value.value for value in status.values}


@pytest.fixture
def make_graph(make_bench):
    def make(**parameters):
        # An acceleration that reaches full speed in one period: plain numbers to compare with.
        plain = {'lockstep': True, 'max_acceleration_rad_s2': 1e4, 'dead_zone_rad': 0.0}
        parameters = {'use_sim_time': True, **plain, **parameters}
        subscribes = [JOINT_COMMANDS, GATE_STATUS, INTERRUPTED]
        return Graph(make_bench(GateNode, PUBLISHES, subscribes, **parameters))

    return make


@pytest.fixture
def graph(make_graph):
    return make_graph()


def test_complete_set_is_answered_by_one_command_with_the_stamp_of_the_image(graph):
    first = graph.image()
    assert first.header == header(graph.stamp_ns, ''), 'stamp of the image, unchanged'
    assert list(first.name) == ['pan', 'tilt']
    assert list(first.position) == [0.0, 0.0], 'the first command is where the head stands'
    second = graph.image()
    assert to_ns(second.header.stamp) == graph.stamp_ns
    assert second.position[0] == pytest.approx(-SPEED * PERIOD_NS / 1e9), 'at limited speed'
    assert len(graph.bench.messages(JOINT_COMMANDS)) == 2


def test_status_holds_phase_source_and_the_limit_that_cut(graph):
    graph.image()
    graph.image()
    status, values = graph.status()
    assert (status.level, status.message) == (bytes([Level.OK]), 'look')
    assert values['source'] == 'face'
    assert values['clamped'] == 'speed'
    assert float(values['p_lm']) == pytest.approx(0.0180, abs=1e-4)
    assert (values['trials'], values['shifts'], values['enabled']) == ('0', '0', 'True')


def test_incomplete_set_is_not_answered(graph):
    graph.image()
    unanswered = graph.stamp_ns + PERIOD_NS
    graph.bench.publish_posture(unanswered)
    graph.publish_proposals(FACE_RIGHT, stamp_ns=unanswered, without=[LM_DELTA])
    graph.bench.wait(lambda: graph.bench.received(FIXATION) == 2)
    graph.stamp_ns = unanswered
    # The answer to a later image comes after all answers to earlier ones.
    graph.image()
    stamps = [to_ns(command.header.stamp) for command in graph.bench.messages(JOINT_COMMANDS)]
    assert stamps == [unanswered - PERIOD_NS, unanswered + PERIOD_NS]


def test_set_is_answered_when_its_last_proposal_comes(graph):
    graph.image()
    graph.stamp_ns += PERIOD_NS
    graph.bench.publish_posture(graph.stamp_ns)
    graph.publish_proposals(FACE_RIGHT, without=[LM_DELTA])
    graph.bench.wait(lambda: graph.bench.received(FIXATION) == 2)
    graph.bench.publish(LM_DELTA, joint_state(graph.stamp_ns))
    graph.answer()
    assert len(graph.bench.messages(JOINT_COMMANDS)) == 2


def test_whole_trial_over_topics(graph):
    """Look, dwell, shift by visual feedback, fixate, look back: phases and trials count up."""
    phases = []
    ball = 0.25
    for _ in range(14):
        seen = {FACE_DELTA: (-graph.pan, 0.0), VF_DELTA: (ball - graph.pan, 0.0)}
        if math.isclose(graph.pan, ball):
            seen[FIXATION] = (ball, 0.0)
        graph.image(seen)
        phases.append(graph.status()[1]['phase'])
    order = [p for i, p in enumerate(phases) if i == 0 or p != phases[i - 1]]
    assert order[:3] == ['look', 'shift', 'look']
    assert int(graph.status()[1]['trials']) >= 1


def test_repeated_image_gets_the_identical_command(graph):
    graph.image()
    answer = graph.image()
    for _ in range(3):
        graph.publish_proposals({FACE_DELTA: (9.0, 9.0)})
        assert graph.bench.next(JOINT_COMMANDS) == answer
    assert graph.image().position[0] == pytest.approx(2 * answer.position[0]), 'and no step more'


def test_late_image_is_not_answered(graph):
    graph.image()
    graph.image()
    graph.publish_proposals(FACE_RIGHT, stamp_ns=graph.stamp_ns - PERIOD_NS)
    answer = graph.image()
    assert to_ns(answer.header.stamp) == graph.stamp_ns
    assert len(graph.bench.messages(JOINT_COMMANDS)) == 3


def test_clock_set_back_starts_again_from_where_the_head_stands(graph):
    graph.stamp_ns = 500 * 10**9
    for _ in range(3):
        graph.image()
    stopped = graph.pan
    graph.stamp_ns = 5 * 10**9
    assert graph.image(follow=False).position[0] == pytest.approx(stopped), 'it brakes'
    graph.pan = 0.3
    assert graph.image().position[0] == pytest.approx(0.3)
    assert graph.image().position[0] == pytest.approx(0.3 - SPEED * PERIOD_NS / 1e9)


def test_clock_set_forward_is_no_leap_of_the_head(make_graph):
    graph = make_graph(max_speed_rad_s=0.1)
    graph.image()
    graph.stamp_ns += 1000 * 10**9
    assert graph.image().position[0] == pytest.approx(-0.2), 'of two seconds at most'


def test_disabled_gate_holds_and_starts_from_where_the_head_stands(graph):
    graph.image()
    graph.image()
    assert graph.bench.call(SetBool, 'gate/enable', data=False).success
    held = graph.image()
    for sag in (0.0, 0.02, -0.05):
        graph.pan = held.position[0] + sag
        assert graph.image(follow=False).position == held.position
    assert graph.status()[1]['reason'] == 'disabled'
    graph.pan = 0.2
    graph.bench.call(SetBool, 'gate/enable', data=True)
    assert graph.image().position[0] == pytest.approx(0.2)
    assert graph.image().position[0] == pytest.approx(0.0)


def test_gate_may_start_disabled(make_graph):
    graph = make_graph(enabled_at_start=False)
    graph.pan = 0.1
    for _ in range(2):
        assert graph.image().position[0] == pytest.approx(0.1)


def test_home_turns_to_the_home_posture_and_looks_from_there(make_graph):
    graph = make_graph(home_pan_rad=0.3, home_tilt_rad=0.0)
    graph.image()
    assert graph.bench.call(Trigger, 'gate/home').success
    assert graph.image().position[0] == pytest.approx(0.2)
    assert graph.status()[1]['phase'] == 'home'
    for _ in range(5):
        graph.image({})
    assert graph.pan == pytest.approx(0.3)
    assert graph.status()[1]['phase'] == 'look'


def test_home_is_refused_while_disabled(make_graph):
    graph = make_graph(enabled_at_start=False)
    response = graph.bench.call(Trigger, 'gate/home')
    assert not response.success
    assert response.message == 'the gate is disabled: call gate/enable first'


def test_command_stays_inside_the_position_limits(make_graph):
    graph = make_graph(pan_min_rad=-0.3)
    commands = [graph.image({FACE_DELTA: (-2.0, 0.0)}).position[0] for _ in range(5)]
    assert min(commands) == pytest.approx(-0.28), 'by the soft margin'
    assert graph.status()[1]['clamped'] == 'position'


@pytest.mark.parametrize(
    ('message', 'text'),
    [
        (joint_state(0, math.nan, 0.0), 'position of'),
        (joint_state(0, 0.1), '1 numbers in position for 2 names'),
    ],
)
def test_broken_proposal_is_one_clear_error_and_not_a_command(graph, message, text):
    graph.image()
    graph.stamp_ns += PERIOD_NS
    graph.publish_proposals({}, without=[VF_DELTA])
    message.header = header(graph.stamp_ns)
    graph.bench.publish(VF_DELTA, message)
    graph.bench.wait_for_complaint(f'/visual_feedback/delta: {text}')
    graph.image()
    assert len(graph.bench.messages(JOINT_COMMANDS)) == 2


def test_unknown_joint_is_named(graph):
    seen = set()

    def is_named():
        graph.bench.publish_posture(graph.stamp_ns, name=['head_pan', 'tilt'])
        seen.add(graph.bench.complaint())
        return any("joint_states: no position of 'pan' for more than 2 s" in text for text in seen)

    graph.bench.wait(is_named)
    assert any("set pan_joint to the name, 'head_pan'?" in text for text in seen)
    graph.image()


def test_parameters_of_the_running_gate(graph):
    set_parameter = graph.bench.set_parameter
    graph.image()
    assert set_parameter('max_speed_rad_s', 1).successful
    assert graph.image().position[0] == pytest.approx(-0.1)
    for name, value, reason in (
        ('max_speed_rad_s', -1.0, 'max_speed_rad_s'),
        ('pan_max_rad', -2.0, 'lower limit below its upper limit'),
        ('gating', 'chance', 'sigmoid, constant'),
        ('max_shifts', 0, 'max_shifts'),
        ('seed', 3, 'read-only'),
    ):
        result = set_parameter(name, value)
        assert not result.successful
        assert reason in result.reason
    assert graph.image().position[0] == pytest.approx(-0.2), 'nothing changed'
    assert set_parameter('gating', 'constant').successful
    graph.image()
    assert graph.status()[1]['p_lm'] == '1.0000'


def test_not_finite_proposals_of_every_kind_move_nothing(graph):
    """A complete set with one number that is not finite: no answer, and one complaint."""
    graph.image()
    for topic in PROPOSALS:
        graph.stamp_ns += PERIOD_NS
        graph.publish_proposals({topic: (math.inf, math.nan)})
        graph.bench.wait_for_complaint(f'/{topic.name}: position of')
    graph.image({})
    assert len(graph.bench.messages(JOINT_COMMANDS)) == 2


def test_count_of_trials_is_kept_over_a_restart(make_graph, tmp_path):
    path = tmp_path / 'trials'
    path.write_text('41\n')
    graph = make_graph(trials_file=str(path), dwell_s=0.0, max_shifts=1, settle_timeout_s=0.05)
    for _ in range(6):
        graph.image({FACE_DELTA: (0.0, 0.0)})
    trials = int(graph.status()[1]['trials'])
    assert trials > 41
    graph.bench.wait(lambda: path.read_text() == f'{trials}\n')
    graph.bench.wait(lambda: [each.name for each in tmp_path.iterdir()] == ['trials'])


def test_a_count_that_cannot_be_saved_takes_no_answer_and_is_saved_later(make_graph, tmp_path):
    path = tmp_path / 'kept' / 'trials'
    parameters = {'dwell_s': 0.0, 'max_shifts': 1, 'settle_timeout_s': 0.05}
    graph = make_graph(trials_file=str(path), **parameters)
    graph.bench.wait(path.exists)
    path.unlink()
    path.parent.rmdir()
    path.parent.write_text('a file in the place of the folder')
    for _ in range(6):
        graph.image({FACE_DELTA: (0.0, 0.0)})
    trials = int(graph.status()[1]['trials'])
    assert trials > 1
    for _ in range(2):  # again and again, as long as it lasts
        graph.bench.wait_for_complaint(f'trials_file: not saved: {path} cannot be written')
        graph.bench.node.health.clear_problem('trials_file')
    path.parent.unlink()
    graph.bench.wait(path.exists)
    assert path.read_text() == f'{trials}\n'
    graph.bench.wait(lambda: 'trials_file' not in graph.bench.complaint())


def test_an_error_in_the_decision_takes_no_answer_away(make_graph, monkeypatch):
    graph = make_graph()
    graph.image()

    def fail(_):
        raise OSError(28, 'No space left on device')

    with monkeypatch.context() as broken:
        broken.setattr(graph.bench.node._cycle, 'step', fail)
        graph.image()
        graph.bench.wait_for_complaint('No space left on device')
    graph.image()


def test_heads_side_by_side_count_their_trials_apart(make_bench, tmp_path):
    (tmp_path / 'left').mkdir()
    (tmp_path / 'left' / 'trials').write_text('41\n')
    (tmp_path / 'trials').write_text('no count\n')
    in_namespace = partial(GateNode, namespace='left')
    make_bench(in_namespace, trials_file=str(tmp_path / 'trials'))
    with pytest.raises(ConfigError, match='holds no count of trials'):
        make_bench(GateNode, trials_file=str(tmp_path / 'trials'))


def test_joint_trajectory_has_one_point_and_a_zero_stamp(make_bench):
    parameters = {'output': 'joint_trajectory', 'time_from_start_s': 1.25, 'lockstep': True}
    subscribes = [JOINT_COMMANDS, GATE_STATUS, JOINT_TRAJECTORY]
    bench = make_bench(GateNode, PUBLISHES, subscribes, use_sim_time=True, **parameters)
    graph = Graph(bench)
    graph.image()
    graph.image()
    bench.wait(lambda: len(bench.messages(JOINT_TRAJECTORY)) == 2)
    trajectory = bench.messages(JOINT_TRAJECTORY)[-1]
    assert to_ns(trajectory.header.stamp) == 0
    assert list(trajectory.joint_names) == ['pan', 'tilt']
    [point] = trajectory.points
    assert to_ns(point.time_from_start) == 1_250_000_000
    assert list(point.positions) == list(bench.messages(JOINT_COMMANDS)[-1].position)
    assert point.positions[0] != 0.0


def test_forward_commands_stand_in_the_order_of_the_controller(make_bench):
    parameters = {'output': 'float64_multi_array', 'joint_order': 'tilt_pan', 'lockstep': True}
    parameters |= {'pan_inverted': True, 'pan_offset_rad': 0.5, 'tilt_offset_rad': -0.25}
    subscribes = [JOINT_COMMANDS, GATE_STATUS, FORWARD_COMMANDS]
    bench = make_bench(GateNode, PUBLISHES, subscribes, use_sim_time=True, **parameters)
    graph = Graph(bench)
    graph.pan = 0.4  # in the rig's count: 0.1 to the left of the middle
    graph.image()
    bench.wait(lambda: bench.messages(FORWARD_COMMANDS))
    assert list(bench.messages(FORWARD_COMMANDS)[-1].data) == pytest.approx([0.0, 0.4])


URDF = """<robot name="head"><link name="base"/><link name="neck"/><link name="eye"/>
<joint name="pan" type="revolute"><parent link="base"/><child link="neck"/>
<axis xyz="0 0 1"/><limit lower="-0.2" upper="0.3" velocity="1.0" effort="1"/></joint>
<joint name="tilt" type="revolute"><parent link="neck"/><child link="eye"/>
<axis xyz="0 {tilt} 0"/><limit lower="-0.4" upper="0.2" velocity="1.0" effort="1"/></joint>
</robot>"""


def test_limits_of_the_robot_description(make_bench):
    publishes = [*PUBLISHES, ROBOT_DESCRIPTION]
    subscribes = [JOINT_COMMANDS, GATE_STATUS]
    parameters = {'limits_from': 'robot_description', 'lockstep': True, 'use_sim_time': True}
    bench = make_bench(GateNode, publishes, subscribes, max_acceleration_rad_s2=1e4, **parameters)
    graph = Graph(bench)
    assert graph.image().position[0] == 0.0
    assert graph.image().position[0] == 0.0
    assert graph.status()[1]['reason'] == 'no robot_description yet'
    bench.publish(ROBOT_DESCRIPTION, String(data=URDF.format(tilt=-1)))
    bench.wait_for_complaint('/robot_description: the URDF turns tilt about')
    graph.image()
    reason = graph.status()[1]['reason']
    assert reason.startswith('robot_description cannot be used: the URDF turns tilt about')
    bench.publish(ROBOT_DESCRIPTION, String(data=URDF.format(tilt=1)))
    bench.wait(lambda: bench.received(ROBOT_DESCRIPTION) == 2)
    commands = [graph.image({FACE_DELTA: (-2.0, 0.0)}).position[0] for _ in range(6)]
    assert commands[1] - commands[0] == pytest.approx(-0.1), 'the speed of the URDF'
    assert min(commands) == pytest.approx(-0.18)
    limits = bench.node.health.values['joint limits']
    assert 'pan_min_rad -0.2 (<limit> of pan)' in limits
    assert 'tilt_min_rad -0.4 (<limit> of tilt), tilt_max_rad 0.2 (<limit> of tilt)' in limits
    assert 'max_acceleration_rad_s2 1e+04 (parameter)' in limits


def test_a_head_on_a_robot_that_publishes_each_joint_in_a_message_of_its_own(graph):
    """Also wheels on the same topic, and NaN for the velocity: no complaint, and commands."""
    commands = []
    for _ in range(3):
        graph.stamp_ns += PERIOD_NS
        graph.set_clock(graph.stamp_ns)
        for name, position in (('left_wheel', math.nan), ('pan', graph.pan), ('tilt', 0.0)):
            state = JointState(header=header(graph.stamp_ns), name=[name], position=[position])
            state.velocity = [math.nan]
            graph.bench.publish(JOINT_STATES, state)
        graph.publish_proposals(FACE_RIGHT)
        commands.append(graph.answer())
        graph.pan = commands[-1].position[0]
    assert [command.position[0] for command in commands] == pytest.approx([0.0, -0.2, -0.4])
    assert graph.bench.complaint() == 'OK'


@pytest.mark.parametrize(
    ('evidence', 'p_lm'),
    [
        ({'expected_gain': 1.0}, 1.0),
        ({'expected_gain': 0.0}, 0.0474),
        ({'expected_gain': math.nan}, 0.0474),
        ({}, 0.0474),  # as recordings before there was a gain
        ({'expected_gain': math.nan, 'log_evidence': 30.0}, 1.0),
        ({'expected_gain': 1.0, 'log_evidence': -30.0}, 0.0474),
    ],
)
def test_the_gate_by_expected_gain_follows_what_the_learner_publishes(make_graph, evidence, p_lm):
    graph = make_graph(gating='expected_gain')
    for _ in range(2):
        graph.image(**evidence)
    assert float(graph.status()[1]['p_lm']) == pytest.approx(p_lm, abs=1e-3)


@pytest.mark.parametrize('gain', [-0.1, 1.5, math.inf])
def test_a_gain_that_is_none_is_reported_and_the_next_image_is_answered(make_graph, gain):
    graph = make_graph(gating='expected_gain')
    graph.image()
    graph.stamp_ns += PERIOD_NS
    graph.bench.publish_posture(graph.stamp_ns, graph.pan)
    graph.publish_proposals(FACE_RIGHT, expected_gain=gain)
    graph.image(expected_gain=1.0)
    assert 'expected_gain must be one number from 0 to 1' in graph.bench.complaint()


RATE_HZ = 50.0  # of the commands; slow enough for a busy machine


class RealTime:
    """A gate on its own clock, and a head that follows; the test publishes the images."""

    def __init__(self, make_bench, **parameters):
        publishes = [*PROPOSALS, EVIDENCE, JOINT_STATES, LOOK_AT]
        subscribes = [JOINT_COMMANDS, GATE_STATUS]
        parameters = {'control_rate_hz': RATE_HZ, **parameters}
        self.bench = make_bench(GateNode, publishes, subscribes, **parameters)
        self.pan = 0.0
        self._due_s = 0.0

    def image(self, proposals=FACE_RIGHT, without=(), age_s=0.0, joints=True):
        stamp_ns = time.time_ns() - int(age_s * 1e9)
        if joints:
            self.bench.publish_posture(stamp_ns, self.pan)
        for topic in PROPOSALS:
            if topic not in without:
                self.bench.publish(topic, joint_state(stamp_ns, *proposals.get(topic, ())))
        self.bench.publish(EVIDENCE, encode_columns(header(stamp_ns), {'log_evidence': [0.0]}))

    def images(self, until, **image):
        """Publish 30 images a second until a condition holds."""

        def another():
            if time.monotonic() >= self._due_s:
                self._due_s = time.monotonic() + 1 / 30
                self.image(**image)
            self.bench.executor.spin_once(timeout_sec=0.01)
            commands = self.bench.messages(JOINT_COMMANDS)
            if commands:
                self.pan = commands[-1].position[0]
            return until()

        self.bench.wait(another)

    def reason(self):
        statuses = self.bench.messages(GATE_STATUS)
        values = {value.key: value.value for value in statuses[-1].values} if statuses else {}
        return values.get('reason', '')


@pytest.fixture
def real_time(make_bench):
    return lambda **parameters: RealTime(make_bench, **parameters)


def test_commands_come_at_the_control_rate_and_follow_the_profile(real_time):
    rig = real_time(hold_after_s=5.0, stall_after_s=5.0)
    rig.images(lambda: rig.pan < -0.2)
    commands = rig.bench.messages(JOINT_COMMANDS)
    pans = [command.position[0] for command in commands]
    images = {to_ns(command.header.stamp) for command in commands}
    assert len(images) < len(commands), 'more commands than images'
    step = np.abs(np.diff(pans)).max()
    assert step == pytest.approx(SPEED / RATE_HZ)
    assert pans[-1] == min(pans)


def test_silence_brakes_the_head_names_what_is_missing_and_passes(real_time):
    rig = real_time(hold_after_s=1.0, stale_after_s=9.0, stall_after_s=9.0)
    rig.images(lambda: rig.pan < -0.1)
    rig.images(lambda: rig.reason(), without=[LM_DELTA, VF_DELTA])
    assert 'missing: learning_module/delta, visual_feedback/delta' in rig.reason()
    assert 'holding the head' in rig.bench.complaint()
    still = rig.bench.next(JOINT_COMMANDS, 20).position
    assert rig.bench.next(JOINT_COMMANDS, 5).position == still
    rig.images(lambda: not rig.reason())
    rig.images(lambda: rig.pan < still[0] - 0.1)


def test_missing_joint_states_are_named(real_time):
    rig = real_time(hold_after_s=1.0, stale_after_s=9.0, stall_after_s=9.0)
    rig.images(lambda: rig.pan < -0.05)
    rig.images(lambda: rig.reason(), joints=False)
    assert rig.reason().endswith('missing: joint_states')


@pytest.mark.parametrize(
    ('age_s', 'text'), [(2.0, 'image is older than'), (-2.0, 'stamped ahead of the clock')]
)
def test_image_of_another_time_holds_the_head(real_time, age_s, text):
    rig = real_time(hold_after_s=5.0)
    rig.images(lambda: text in rig.reason(), age_s=age_s)
    assert not rig.bench.messages(JOINT_COMMANDS), 'nothing was ever commanded'


def publish_as_peer(topic):
    """Return a function that publishes a topic beside the gate, and returns how to end it."""

    def start(bench):
        publisher = bench.peer.create_publisher(topic.type, topic.name, 10)
        return lambda: bench.peer.destroy_publisher(publisher)

    return start


def publish_from_elsewhere(kind):
    """As `publish_as_peer`, from another participant, as another process would."""

    def start(bench):
        ending = ExitStack()
        domain_id = bench.node.context.get_domain_id()
        context = ending.enter_context(private_context(domain_id=domain_id))
        node = rclpy.create_node('wheels', context=context)
        ending.callback(node.destroy_node)
        node.create_publisher(kind, JOINT_COMMANDS.name, 10)
        return ending.close

    return start


def run_second_gate(bench, **parameters):
    overrides = [Parameter(name, value=value) for name, value in parameters.items()]
    second = GateNode(context=bench.node.context, parameter_overrides=overrides)
    bench.executor.add_node(second)

    def end():
        bench.executor.remove_node(second)
        second.destroy_node()

    return end


@pytest.mark.parametrize(
    ('start', 'name', 'output'),
    [
        (publish_as_peer(JOINT_COMMANDS), '/peer', 'joint_state'),
        (publish_from_elsewhere(JOINT_COMMANDS.type), '/wheels', 'joint_state'),
        (publish_from_elsewhere(Float64MultiArray), '/wheels', 'joint_state'),
        (run_second_gate, 'another /gate', 'joint_state'),
        (publish_as_peer(JOINT_TRAJECTORY), '/peer', 'joint_trajectory'),
        (publish_as_peer(FORWARD_COMMANDS), '/peer', 'float64_multi_array'),
    ],
    ids=['same process', 'elsewhere', 'other type', 'second gate', 'trajectory', 'forward'],
)
def test_no_command_is_sent_while_another_node_commands_the_head(real_time, start, name, output):
    rig = real_time(hold_after_s=5.0, stall_after_s=5.0, output=output)
    bench, commands = rig.bench, rig.bench.messages(JOINT_COMMANDS)
    rig.images(lambda: rig.pan < -0.1)
    end = start(bench)
    rig.images(lambda: f'is published by {name} as well' in rig.reason())
    assert bench.messages(GATE_STATUS)[-1].level == bytes([Level.ERROR])
    report = bench.node.health.report(time.monotonic())
    assert report.level is Level.ERROR
    assert f'is published by {name} as well' in report.message
    statuses = len(bench.messages(GATE_STATUS))
    rig.images(lambda: len(bench.messages(GATE_STATUS)) >= statuses + 3)
    commands.clear()
    rig.pan = 0.3  # turned by the other
    known = bench.received(JOINT_STATES)
    rig.images(lambda: bench.received(JOINT_STATES) > known + 2)
    rig.images(lambda: len(bench.messages(GATE_STATUS)) >= statuses + 6)
    assert not commands, 'not even the posture at which it stopped'
    end()
    rig.images(lambda: commands)
    assert commands[0].position[0] == pytest.approx(0.3, abs=40.0 / RATE_HZ**2), 'no jump'
    rig.images(lambda: rig.pan < 0.2)
    assert not rig.reason()


def test_other_topics_and_other_heads_have_commanders_of_their_own(make_bench, ros_context):
    """A gate with a namespace or a remap guards the topic that it publishes, and no other."""
    remapped = ['--ros-args', '-r', '__ns:=/left', '-r', 'joint_commands:=wheel']
    bench = make_bench(partial(GateNode, cli_args=remapped))
    publish = bench.peer.create_publisher
    for free in ('joint_commands', 'left/joint_commands', 'wheel'):
        publish(JOINT_COMMANDS.type, free, 10)
    bench.wait(lambda: bench.node.count_publishers('/wheel') == 1)
    bench.wait_for_complaint('no joint state yet')
    assert 'published by' not in bench.complaint()
    publish(JOINT_COMMANDS.type, '/left/wheel', 10)
    bench.wait_for_complaint('/left/wheel is published by /peer as well')


def test_status_states_that_no_person_is_seen_and_for_how_long(make_graph):
    graph = make_graph(search_after_s=0.5, search_tilt_rad=0.0)
    graph.image()
    assert graph.status()[1]['unseen_s'] == '0.0'
    for _ in range(4):
        graph.image({})
    assert graph.status()[0].message == 'look', 'a moment is not worth a word'
    for _ in range(18):
        graph.image({})
    status, values = graph.status()
    assert status.message == 'search: I see no person to look at, for 2 s'
    assert (status.level, values['unseen_s']) == (bytes([Level.OK]), '2.1')
    health = graph.bench.node.health.report(time.monotonic())
    assert health.values['person'] == 'I see no person to look at, for 2 s'
    graph.image()
    assert graph.status()[0].message == 'look'


def test_two_gates_in_lockstep_both_answer_with_the_measured_posture(make_graph):
    """The sim waits for an answer, and two different ones would pull the head to and fro."""
    graph = make_graph()
    graph.image()
    graph.image()
    parameters = {'lockstep': True, 'use_sim_time': True, 'max_acceleration_rad_s2': 1e4}
    end = run_second_gate(graph.bench, **parameters)
    graph.bench.wait(lambda: graph.bench.node.count_publishers(JOINT_COMMANDS.name) == 2)
    commands = graph.bench.messages(JOINT_COMMANDS)
    graph.image(follow=False)
    answered = len(commands)
    for pan in (0.1, 0.12, -0.2):
        graph.pan = pan
        graph.image(follow=False)
        assert commands[-1].position[0] == pytest.approx(pan)
    assert {round(command.position[0], 6) for command in commands[answered:]} <= {0.1, 0.12, -0.2}
    status, values = graph.status()
    assert status.level == bytes([Level.ERROR])
    assert values['reason'] == '/joint_commands is published by another /gate as well'
    end()
    assert graph.image().position[0] == pytest.approx(-0.2), 'no jump'
    assert graph.image().position[0] == pytest.approx(-0.2 - SPEED * PERIOD_NS / 1e9)


def test_nothing_holds_at_the_start_before_our_own_publisher_is_discovered(graph):
    """From its first image on: the count of publishers must hold our own from the beginning."""
    for _ in range(5):
        graph.image()
        assert 'reason' not in graph.status()[1]


NOT_AHEAD = (2.0, 0.8, 0.0)  # [m]: to the left
AHEAD_OF_IT = (math.atan2(0.8, 2.0), 0.0)


def test_a_point_is_looked_at_for_its_time_and_then_the_caregiver_again(make_graph):
    graph = make_graph(look_at_hold_s=0.55)
    for _ in range(3):
        graph.image({FACE_DELTA: (-graph.pan, 0.0)})
    graph.look_at(*NOT_AHEAD)
    commands, phases = [], []
    for _ in range(9):
        commands.append(graph.image({FACE_DELTA: (-graph.pan, 0.0)}))
        phases.append(graph.phase())
    assert phases == ['look_at'] * 6 + ['look'] * 3
    assert commands[0].position[0] == pytest.approx(SPEED * PERIOD_NS / 1e9, abs=0.005), 'guarded'
    assert list(commands[4].position) == pytest.approx(AHEAD_OF_IT, abs=1e-6)
    assert commands[-1].position[0] == pytest.approx(0.0, abs=1e-6)
    assert graph.status()[1]['trials'] == '0'


def test_points_that_come_with_each_image_are_followed(make_graph):
    graph = make_graph(look_at_hold_s=0.15)
    graph.image()
    for step in range(12):
        graph.look_at(1.0, 0.05 * step, 0.0)
        graph.image()
        assert graph.phase() == 'look_at'
        assert graph.pan == pytest.approx(math.atan(0.05 * step), abs=1e-6)


def test_a_point_seen_by_the_camera_uses_the_posture_at_its_stamp(graph):
    """The head has turned on since; the posture of that image counts, not the newest."""
    for _ in range(4):
        graph.image()
    seen_ns, pan = graph.stamp_ns - PERIOD_NS // 2, graph.pan
    at_stamp = pan + SPEED * PERIOD_NS / 1e9 / 2  # between the last two images
    at_stamp = at_stamp + SPEED * PERIOD_NS / 1e9  # the command is one image ahead of the head
    graph.look_at(0.2, 0.0, 2.0, frame='camera_optical_frame', stamp_ns=seen_ns)
    for _ in range(6):
        graph.image()
    assert graph.pan == pytest.approx(at_stamp - math.atan(0.1), abs=1e-3)


def test_a_point_of_the_camera_waits_for_the_joint_states_of_its_time(graph):
    for _ in range(2):
        graph.image()
    later = graph.stamp_ns + PERIOD_NS // 2
    graph.look_at(0.0, 0.0, 1.0, frame='camera_optical_frame', stamp_ns=later)
    before = graph.pan
    graph.image()
    assert graph.phase() == 'look_at'
    for _ in range(4):
        graph.image()
    assert graph.pan == pytest.approx(before / 2, abs=1e-3), 'half way of its last motion'


def test_a_stamp_of_zero_is_now(graph):
    graph.image()
    graph.look_at(0.5, 0.0, 1.0, frame='camera_optical_frame', stamp_ns=0)
    for _ in range(4):
        graph.image()
    assert graph.pan == pytest.approx(-math.atan(0.5), abs=1e-6)
    graph.look_at(1.0, 0.1, 0.0, stamp_ns=0)
    for _ in range(4):
        graph.image()
    assert graph.pan == pytest.approx(math.atan(0.1), abs=1e-6)


@pytest.mark.parametrize(
    ('point', 'frame', 'late_s', 'reason'),
    [
        ((1.0, 0.0, 0.0), 'map', 0.0, "'map' is not known: give the point in 'base_link'"),
        ((1.0, 0.0, 0.0), '', 0.0, "the frame '' is not known"),
        ((math.nan, 0.0, 0.0), 'base_link', 0.0, 'the point is not finite'),
        ((0.0, 0.0, 0.0), 'camera_optical_frame', 0.0, 'it has no direction'),
        ((-1.0, 0.1, 0.0), 'base_link', 0.0, 'the point is behind the head'),
        ((0.0, 0.0, -1.0), 'camera_optical_frame', 0.0, 'the point is behind the head'),
        ((1.0, 0.0, 0.0), 'base_link', 0.7, 'the point is 0.7 s old'),
        ((1.0, 0.0, 0.0), 'camera_optical_frame', 0.7, 'the point is 0.7 s old'),
        ((1.0, 0.0, 0.0), 'base_link', -60.0, 'stamped 60 s ahead of the clock of the gate'),
        ((1.0, 0.0, 0.0), 'camera_optical_frame', -60.0, 'ahead of the clock of the gate'),
    ],
)
def test_a_point_that_cannot_be_used_is_one_warning_and_changes_nothing(
    make_graph, point, frame, late_s, reason
):
    graph = make_graph(pan_min_rad=-1.5, pan_max_rad=1.5)
    for _ in range(2):
        graph.image()
    commands = []
    for _ in range(3):
        graph.look_at(*point, frame=frame, stamp_ns=graph.stamp_ns - int(late_s * 1e9))
        commands.append(graph.image().position[0])
        assert graph.phase() == 'look'
    assert np.diff(commands) == pytest.approx(-SPEED * PERIOD_NS / 1e9), 'the face, as before'
    complaint = graph.bench.complaint()
    assert complaint.startswith('/look_at: refused: ')
    assert reason in complaint
    assert graph.bench.node.health.report(time.monotonic()).level is Level.WARN


def test_a_point_beyond_the_limits_is_looked_at_as_far_as_they_allow(make_graph):
    graph = make_graph(pan_max_rad=0.5)
    graph.image()
    graph.look_at(1.0, 5.0, 0.0)
    for _ in range(5):
        graph.image()
    assert graph.pan == pytest.approx(0.48)
    assert graph.status()[1]['clamped'] == 'position'


def test_no_point_moves_a_disabled_or_held_head(make_graph):
    graph = make_graph(enabled_at_start=False)
    graph.image()
    graph.look_at(*NOT_AHEAD)
    for _ in range(3):
        assert graph.image().position[0] == 0.0
    assert 'refused: the gate is disabled: call gate/enable first' in graph.bench.complaint()
    graph.bench.call(SetBool, 'gate/enable', data=True)
    for _ in range(2):
        graph.image({})
    assert graph.pan == 0.0
    graph.look_at(*NOT_AHEAD)
    graph.image({})
    assert graph.phase() == 'look_at'
    graph.bench.call(SetBool, 'gate/enable', data=False)
    held = graph.image({}).position
    for _ in range(3):
        assert graph.image({}).position == held
    graph.bench.call(SetBool, 'gate/enable', data=True)
    for _ in range(3):
        assert graph.image({}).position == held, 'the point is over'


def test_a_held_head_refuses_points_with_the_reason(make_graph):
    graph = make_graph(limits_from='robot_description')
    graph.image()
    graph.look_at(*NOT_AHEAD)
    assert 'refused: the head is held: no robot_description yet' in graph.bench.complaint()


def test_clear_look_at_ends_it(graph):
    response = graph.bench.call(Trigger, 'gate/clear_look_at')
    assert (response.success, response.message) == (True, 'the head looked at no point')
    for _ in range(2):
        graph.image({FACE_DELTA: (0.0, 0.0)})
    graph.look_at(*NOT_AHEAD)
    graph.image({})
    response = graph.bench.call(Trigger, 'gate/clear_look_at')
    assert (response.success, response.message) == (True, 'looking at the caregiver again')
    for _ in range(3):
        graph.image({})
        assert graph.phase() == 'look'
    assert graph.pan == pytest.approx(0.0, abs=1e-6)


def test_home_and_a_point_end_each_other(make_graph):
    graph = make_graph(home_pan_rad=-0.3)
    graph.image({})
    graph.look_at(*NOT_AHEAD)
    graph.image({})
    graph.bench.call(Trigger, 'gate/home')
    graph.image({})
    assert graph.phase() == 'home'
    graph.look_at(*NOT_AHEAD)
    for _ in range(4):
        graph.image({})
    assert graph.pan == pytest.approx(AHEAD_OF_IT[0], abs=1e-6)


def test_what_interrupts_a_trial_is_published_with_the_stamps_of_its_images(graph):
    def interrupted():
        """Return how many images ago each interruption was, since the last call."""
        messages = graph.bench.messages(INTERRUPTED)
        found = [(graph.stamp_ns - to_ns(each.stamp)) // PERIOD_NS for each in messages]
        messages.clear()
        return found

    waits = graph.bench.wait
    for _ in range(4):
        graph.image({})
    assert interrupted() == [], 'not by the start'
    graph.look_at(*NOT_AHEAD)
    waits(lambda: graph.bench.messages(INTERRUPTED))
    assert interrupted() == [0], 'at once'
    for _ in range(2):
        graph.image({})
        waits(lambda: graph.bench.messages(INTERRUPTED))
        assert interrupted() == [0]
    graph.bench.call(Trigger, 'gate/clear_look_at')
    for _ in range(3):
        graph.image({})
        graph.status()
    assert interrupted() == []
    for service, request in ((Trigger, {}), (SetBool, {'data': False})):
        graph.bench.call(service, 'gate/home' if service is Trigger else 'gate/enable', **request)
        for _ in range(3):
            graph.image({}, follow=False)
            waits(lambda: graph.bench.messages(INTERRUPTED))
        assert interrupted()[-1] == 0


@pytest.mark.parametrize(('kind', 'name', 'request_'), [
    (SetBool, 'enable', {'data': True}), (Trigger, 'home', {}),
])  # fmt: skip
def test_old_names_of_services_work_with_one_warning(graph, capfd, kind, name, request_):
    graph.image()
    assert graph.bench.call(kind, f'gate/{name}', **request_).success
    assert 'was called' not in capfd.readouterr().err
    for _ in range(2):
        assert graph.bench.call(kind, name, **request_).success
    text = f'/{name} was called, which the next release will not have: call /gate/{name}'
    assert capfd.readouterr().err.count(text) == 1


def test_a_point_in_real_time_is_followed_at_the_control_rate(real_time):
    rig = real_time(hold_after_s=5.0, stall_after_s=5.0, stale_after_s=5.0)
    rig.images(lambda: rig.pan < -0.1)
    rig.bench.publish(LOOK_AT, point_stamped((0.0, 0.0, 1.0), 'map', time.time_ns()))
    rig.bench.wait_for_complaint("the frame 'map' is not known")

    def pointed():
        rig.bench.publish(LOOK_AT, point_stamped((1.0, 0.5, 0.0), 'base_link', time.time_ns()))
        return abs(rig.pan - math.atan(0.5)) < 0.01

    rig.images(pointed)
    status = rig.bench.messages(GATE_STATUS)[-1]
    assert status.message == 'look_at'
