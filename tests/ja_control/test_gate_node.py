"""`gate`: one command for every complete set of proposals; everything else holds the head."""

import math

import pytest
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger

from ja_common.core.health import Level
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    CLOCK,
    FACE_DELTA,
    FIXATION,
    GATE_STATUS,
    JOINT_COMMANDS,
    JOINT_STATES,
    LM_DELTA,
    VF_DELTA,
)
from ja_control.gate_node import GateNode
from node_bench import header, joint_state

PERIOD_NS = 100_000_000
PROPOSALS = (VF_DELTA, FACE_DELTA, LM_DELTA, FIXATION)
FACE_RIGHT = {FACE_DELTA: (-0.5, 0.0)}
SPEED = 2.0  # the gate's default [rad/s]


class Graph:
    """The rest of the graph around a gate: a clock, a head, and what the others propose."""

    def __init__(self, bench):
        self.bench = bench
        self.stamp_ns = 10**9
        self.pan = 0.0
        bench.wait(lambda: bench.peer.count_subscribers('/clock'))

    def tell(self, proposals, stamp_ns=None, without=()):
        """All topics of one image; those not in `proposals` have nothing to say."""
        stamp_ns = self.stamp_ns if stamp_ns is None else stamp_ns
        for topic in PROPOSALS:
            if topic not in without:
                self.bench.say(topic, joint_state(stamp_ns, *proposals.get(topic, ())))

    def image(self, proposals=FACE_RIGHT, age_s=0.0, follow=True):
        """The next image; the command that answers it, which the head obeys at once."""
        self.stamp_ns += PERIOD_NS
        self.set_clock(self.stamp_ns + int(age_s * 1e9))
        self.bench.say_posture(self.stamp_ns, self.pan)
        self.tell(proposals)
        command = self.answer()
        if follow:
            self.pan = command.position[0]
        return command

    def answer(self):
        """The command that carries the header of the last image."""
        asked = header(self.stamp_ns)
        heard = self.bench.heard(JOINT_COMMANDS)
        self.bench.wait(lambda: any(command.header == asked for command in heard))
        return next(command for command in reversed(heard) if command.header == asked)

    def set_clock(self, now_ns):
        """Set /clock, and wait until the gate goes by it."""
        clock = self.bench.node.get_clock()

        def set_and_seen():
            self.bench.say(CLOCK, Clock(clock=to_time(now_ns)))
            return clock.now().nanoseconds == now_ns

        self.bench.wait(set_and_seen)

    def status(self):
        """The status that goes with the last command."""
        heard = self.bench.heard
        self.bench.wait(lambda: len(heard(GATE_STATUS)) >= len(heard(JOINT_COMMANDS)))
        status = heard(GATE_STATUS)[-1]
        return status, {value.key: value.value for value in status.values}

    def hold(self):
        """Say nothing until the watchdog holds the head."""
        self.bench.wait(lambda: 'hold' in self.status()[0].message)
        return self.bench.heard(JOINT_COMMANDS)[-1]


@pytest.fixture
def make_graph(make_bench):
    def make(**parameters):
        # By default silence is no matter of these tests: a slow machine must not hold the head.
        parameters = {'use_sim_time': True, 'stale_after_s': 30.0, **parameters}
        says, hears = [*PROPOSALS, JOINT_STATES, CLOCK], [JOINT_COMMANDS, GATE_STATUS]
        return Graph(make_bench(GateNode, says, hears, **parameters))

    return make


@pytest.fixture
def graph(make_graph):
    return make_graph()


def test_complete_set_is_answered_by_one_command_with_the_stamp_of_the_image(graph):
    first = graph.image()
    assert first.header == header(graph.stamp_ns), 'header of the image, unchanged'
    assert list(first.name) == ['pan', 'tilt']
    assert list(first.position) == [0.0, 0.0], 'the first command is where the head stands'
    second = graph.image()
    assert to_ns(second.header.stamp) == graph.stamp_ns
    assert second.position[0] == pytest.approx(-SPEED * PERIOD_NS / 1e9), 'at limited speed'
    assert len(graph.bench.heard(JOINT_COMMANDS)) == 2


def test_status_tells_phase_source_and_what_was_cut(graph):
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
    graph.stamp_ns += PERIOD_NS
    graph.bench.say_posture(graph.stamp_ns)
    graph.tell(FACE_RIGHT, without=[LM_DELTA])
    graph.bench.wait(lambda: graph.bench.received(FIXATION) == 2)
    assert len(graph.bench.heard(JOINT_COMMANDS)) == 1
    graph.bench.say(LM_DELTA, joint_state(graph.stamp_ns))
    graph.bench.next(JOINT_COMMANDS)


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
        graph.tell({FACE_DELTA: (9.0, 9.0)})
        assert graph.bench.next(JOINT_COMMANDS) == answer
    assert graph.image().position[0] == pytest.approx(2 * answer.position[0]), 'and no step more'


def test_late_image_is_not_answered(graph):
    graph.image()
    graph.image()
    graph.tell(FACE_RIGHT, stamp_ns=graph.stamp_ns - PERIOD_NS)
    answer = graph.image()
    assert to_ns(answer.header.stamp) == graph.stamp_ns
    assert len(graph.bench.heard(JOINT_COMMANDS)) == 3


def test_clock_set_back_starts_again_from_where_the_head_stands(graph):
    graph.stamp_ns = 500 * 10**9
    for _ in range(3):
        graph.image()
    graph.stamp_ns, graph.pan = 5 * 10**9, 0.3
    assert graph.image().position[0] == pytest.approx(0.3)
    assert graph.image().position[0] == pytest.approx(0.3 - SPEED * PERIOD_NS / 1e9)


def test_clock_set_forward_is_no_leap_of_the_head(make_graph):
    graph = make_graph(stale_after_s=3.0, max_speed_rad_s=0.1)
    graph.image()
    graph.stamp_ns += 1000 * 10**9
    assert graph.image().position[0] == pytest.approx(-0.3)


def test_silence_holds_the_head_where_it_stands_now(make_graph):
    graph = make_graph(stale_after_s=0.4)
    graph.image()
    graph.image(follow=False)
    graph.bench.say_posture(graph.stamp_ns + PERIOD_NS // 2, -0.05)
    graph.tell(FACE_RIGHT, stamp_ns=graph.stamp_ns + PERIOD_NS, without=[LM_DELTA, VF_DELTA])
    held = graph.hold()
    assert list(held.position) == pytest.approx([-0.05, 0.0])
    status, values = graph.status()
    assert status.level == bytes([Level.WARN])
    assert 'no learning_module/delta, visual_feedback/delta for' in values['reason']
    assert 'holding the head where it is' in graph.bench.complaint()


def test_missing_joint_states_are_named(make_graph):
    graph = make_graph(stale_after_s=0.4)
    graph.image()
    graph.tell(FACE_RIGHT, stamp_ns=graph.stamp_ns + PERIOD_NS)
    graph.hold()
    assert graph.status()[1]['reason'].startswith('no joint_states for')


def test_after_a_hold_the_head_starts_from_its_measured_posture(make_graph):
    graph = make_graph(stale_after_s=0.4, dwell_s=0.0)
    for _ in range(2):
        graph.image({FACE_DELTA: (0.0, 0.0), VF_DELTA: (0.3, 0.0)})
    assert graph.status()[0].message == 'shift'
    graph.hold()
    graph.pan = 0.4  # somebody turned it
    assert graph.image().position[0] == pytest.approx(0.4)
    assert graph.status()[0].message == 'look', 'the shift that was under way is given up'


def test_image_repeated_after_a_hold_is_answered_under_its_own_stamp(make_graph):
    """In lockstep the sim waits for exactly this answer."""
    graph = make_graph(stale_after_s=0.4)
    graph.image(age_s=0.01)
    graph.image(age_s=0.01)
    assert to_ns(graph.hold().header.stamp) != graph.stamp_ns
    graph.tell(FACE_RIGHT)
    assert to_ns(graph.bench.next(JOINT_COMMANDS).header.stamp) == graph.stamp_ns


def test_old_image_holds_where_the_head_stands_now(make_graph):
    graph = make_graph(stale_after_s=0.5)
    graph.image()
    graph.stamp_ns += PERIOD_NS
    graph.set_clock(graph.stamp_ns + 10**9)
    graph.bench.say_posture(graph.stamp_ns, 0.1)
    graph.bench.say_posture(graph.stamp_ns + 10**9, 0.3)
    graph.bench.wait(lambda: graph.bench.received(JOINT_STATES) == 3)
    graph.tell(FACE_RIGHT)
    command = graph.bench.next(JOINT_COMMANDS)
    assert list(command.position) == pytest.approx([0.3, 0.0]), 'never moves on old data'
    assert graph.status()[1]['reason'] == 'the newest image is 1.0 s old'


def test_disabled_gate_holds_and_starts_from_where_the_head_stands(graph):
    graph.image()
    graph.image()
    assert graph.bench.call(SetBool, 'enable', data=False).success
    held = graph.image()
    for sag in (0.0, 0.02, -0.05):
        graph.pan = held.position[0] + sag
        assert graph.image(follow=False).position == held.position
    assert graph.status()[1]['reason'] == 'disabled'
    graph.pan = 0.2
    graph.bench.call(SetBool, 'enable', data=True)
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
    assert graph.bench.call(Trigger, 'home').success
    assert graph.image().position[0] == pytest.approx(0.2)
    assert graph.status()[1]['phase'] == 'home'
    for _ in range(5):
        graph.image({})
    assert graph.pan == pytest.approx(0.3)
    assert graph.status()[1]['phase'] == 'look'


def test_home_is_refused_while_disabled(make_graph):
    graph = make_graph(enabled_at_start=False)
    response = graph.bench.call(Trigger, 'home')
    assert not response.success
    assert response.message == 'the gate is disabled: call enable first'


def test_command_stays_inside_the_position_limits(make_graph):
    graph = make_graph(pan_min_rad=-0.3)
    commands = [graph.image({FACE_DELTA: (-2.0, 0.0)}).position[0] for _ in range(5)]
    assert min(commands) == pytest.approx(-0.3)
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
    graph.tell({}, without=[VF_DELTA])
    message.header = header(graph.stamp_ns)
    graph.bench.say(VF_DELTA, message)
    graph.bench.wait_for_complaint(f'/visual_feedback/delta: {text}')
    graph.image()
    assert len(graph.bench.heard(JOINT_COMMANDS)) == 2


def test_unknown_joint_is_named(graph):
    graph.bench.say_posture(graph.stamp_ns, name=['neck', 'tilt'])
    graph.bench.wait_for_complaint("/joint_states: no joint ['pan'] in the message; it names")
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
