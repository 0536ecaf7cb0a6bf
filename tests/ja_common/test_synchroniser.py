"""A node is called with whole sets of one stamp, with the posture, in stamp order."""

import time
from collections.abc import Callable
from typing import Any

import pytest
from sensor_msgs.msg import JointState

from ja_common.core.health import Level
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.topics import FACE_DELTA, FIXATION, JOINT_STATES, LM_DELTA, VF_DELTA
from node_bench import NodeBench, header, joint_state

MS = 1_000_000


class Recorder(GraphNode):
    """Records the sets that it is called with: which, stamp [ms], pan of the posture."""

    patience_s: float | None = None

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('recorder', **node_kwargs)
        joints = JointCodec(self.configure(JointConfig))
        self.calls: list[tuple[str, int, float | None]] = []
        self.calibrated = True
        self.synchroniser = Synchroniser(
            self, joints, patience_s=self.patience_s, is_calibrated=lambda: self.calibrated
        )
        self.synchroniser.call_with(
            {VF_DELTA: joints.decode, FACE_DELTA: joints.decode},
            lambda found: self._record('pair', found),
            also={LM_DELTA: joints.decode},
            also_which=lambda delta: [] if delta is None else [LM_DELTA],
        )
        self.synchroniser.call_with(
            {FIXATION: joints.decode}, lambda found: self._record('single', found)
        )

    def _record(self, kind: str, found: StampedSet) -> None:
        posture = found.posture_or_none
        pan = None if posture is None else round(float(posture.position[0]), 6)
        self.calls.append((kind, found.stamp_ns // MS, pan))


class PatientRecorder(Recorder):
    """Waits for a posture for a moment only."""

    patience_s = 0.2


SPOKEN = [JOINT_STATES, VF_DELTA, FACE_DELTA, LM_DELTA, FIXATION]


@pytest.fixture
def bench(make_bench: Callable[..., NodeBench]) -> NodeBench:
    return make_bench(Recorder, publishes=SPOKEN)


def send(bench: NodeBench, topic: Any, ms: int, *angles: float) -> None:
    before = bench.received(topic)
    bench.publish(topic, joint_state(ms * MS, *angles))
    bench.wait(lambda: bench.received(topic) > before)


def test_a_set_waits_for_all_its_topics_and_for_the_posture_at_its_stamp(bench):
    bench.publish_posture(0, pan=0.0)
    send(bench, VF_DELTA, 50)
    send(bench, JOINT_STATES, 40, 0.2, 0.0)
    send(bench, FACE_DELTA, 50)
    assert bench.node.calls == []
    assert bench.node.synchroniser.waits_for_posture
    send(bench, JOINT_STATES, 60, 0.4, 0.0)
    assert bench.node.calls == [('pair', 50, 0.3)]
    assert not bench.node.synchroniser.waits_for_posture


def test_a_further_topic_belongs_to_the_stamps_that_the_first_value_says(bench):
    bench.publish_posture(0)
    send(bench, JOINT_STATES, 100, 0.0, 0.0)
    send(bench, VF_DELTA, 20, 0.1, 0.1)  # with a value: LM_DELTA belongs to the set
    send(bench, FACE_DELTA, 20)
    assert bench.node.calls == []
    send(bench, LM_DELTA, 20)
    assert bench.node.calls == [('pair', 20, 0.0)]


def test_sets_of_a_stamp_are_called_in_the_order_in_which_they_were_asked_for(bench):
    bench.publish_posture(0)
    send(bench, JOINT_STATES, 100, 0.0, 0.0)
    send(bench, FIXATION, 10)  # before the pair of the same stamp
    assert bench.node.calls == []
    send(bench, VF_DELTA, 10)
    send(bench, FACE_DELTA, 10)
    assert [call[:2] for call in bench.node.calls] == [('pair', 10), ('single', 10)]


def test_missing_topics_are_named(bench):
    send(bench, VF_DELTA, 10)
    assert bench.node.synchroniser.missing_topics() == {FACE_DELTA.name, FIXATION.name}


def test_a_set_whose_posture_is_older_than_the_history_is_reported(bench):
    bench.publish_posture(1000 * MS)
    send(bench, JOINT_STATES, 1100, 0.0, 0.0)
    send(bench, VF_DELTA, 10)
    send(bench, FACE_DELTA, 10)
    bench.wait_for_complaint('no joint state for the stamp')
    assert bench.node.calls == []


def test_a_patient_node_is_called_without_a_posture_after_its_patience(make_bench):
    bench = make_bench(PatientRecorder, publishes=SPOKEN)
    bench.node.calibrated = False
    send(bench, VF_DELTA, 10)
    send(bench, FACE_DELTA, 10)
    bench.wait(lambda: bench.node.calls)
    assert bench.node.calls == [('pair', 10, None)]


def send_joint(bench: NodeBench, ms: int, name: str, position: float, **more: Any) -> None:
    before = bench.received(JOINT_STATES)
    state = JointState(header=header(ms * MS), name=[name], position=[position], **more)
    bench.publish(JOINT_STATES, state)
    bench.wait(lambda: bench.received(JOINT_STATES) > before)


def test_joints_in_messages_of_their_own_surround_an_image_one_by_one(bench):
    for name in ('pan', 'left_wheel', 'tilt'):
        send_joint(bench, 100, name, 0.0)
    send(bench, FIXATION, 150)
    send(bench, VF_DELTA, 150)
    send(bench, FACE_DELTA, 150)
    send_joint(bench, 200, 'pan', 0.4)
    send_joint(bench, 200, 'left_wheel', 9.0, velocity=[float('nan')])
    assert bench.node.calls == [], 'tilt is not known there yet'
    send_joint(bench, 160, 'tilt', 0.0)
    assert bench.node.calls == [('pair', 150, 0.2), ('single', 150, 0.2)]
    assert "'pan'" not in bench.complaint()


def test_a_joint_that_stays_away_is_named_and_its_return_is_noticed(bench):
    def publish_pan_until(condition: Callable[[], object]) -> None:
        def publish() -> object:
            send_joint(bench, bench.received(JOINT_STATES), 'head_pan', 0.0)
            return condition()

        bench.wait(publish)

    publish_pan_until(lambda: "no position of 'pan' and 'tilt'" in bench.complaint())
    assert "set pan_joint to the name, 'head_pan'? (now 'pan')" in bench.complaint()
    assert bench.node.health.report(time.monotonic()).level is Level.WARN

    def publish_ours() -> object:
        send(bench, JOINT_STATES, bench.received(JOINT_STATES), 0.0, 0.0)
        return "'pan'" not in bench.complaint()

    bench.wait(publish_ours)


def test_an_image_that_no_joint_state_belongs_to_names_the_joint(bench):
    for ms in (1000, 1020):
        send_joint(bench, ms, 'pan', 0.0)
        send_joint(bench, ms + 40, 'tilt', 0.0)
    send(bench, VF_DELTA, 1005)
    send(bench, FACE_DELTA, 1005)
    bench.wait_for_complaint("skipped; 'tilt': its oldest position is 0.035 s newer")


def test_a_patient_node_says_that_the_joint_states_are_late(make_bench):
    bench = make_bench(PatientRecorder, publishes=SPOKEN)
    send(bench, JOINT_STATES, 10, 0.0, 0.0)
    send(bench, VF_DELTA, 5000)
    send(bench, FACE_DELTA, 5000)
    bench.wait_for_complaint("'pan': its newest position is 4.99 s older")
    assert bench.node.calls == [('pair', 5000, None)]
