"""Calls a node with the messages of one stamp and the posture at that stamp, in stamp order."""

import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any

from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ja_common.core.health import Level
from ja_common.core.patient_queue import PatientQueue
from ja_common.core.posture import Posture, PostureHistory, PostureJoin
from ja_common.core.stamp_join import StampJoin
from ja_common.core.stamp_ordered_dispatcher import StampOrderedDispatcher
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec
from ja_common.posture_reader import PostureReader
from ja_common.time_codec import to_ns
from ja_common.topics import JOINT_STATES, Topic

_PATIENCE_CHECKED_EVERY_S = 0.1


@dataclass(frozen=True)
class StampedSet:
    """The decoded messages of one stamp, by topic, and the posture at that stamp.

    `header`: of the message that completed the set. `posture_or_none`: None where the node asked
    for no posture, or where it stays unknown and the node asked to be called all the same.
    """

    header: Header
    stamp_ns: int
    values: Mapping[Topic, Any]
    posture_or_none: Posture | None = None

    def __getitem__(self, topic: Topic) -> Any:
        """Return the decoded message of a topic. Raises KeyError where the set has none."""
        return self.values[topic]

    @property
    def posture(self) -> Posture:
        """Return the posture at the stamp. Raises ValueError where it is unknown."""
        if self.posture_or_none is None:
            raise ValueError(f'the posture at stamp {self.stamp_ns} is not known')
        return self.posture_or_none


Callback = Callable[[StampedSet], None]


class Synchroniser:
    """Subscribes for a node; a callback gets whole sets, once the posture at their stamp is known.

    Sets pass three steps: their messages are joined by stamp (`StampJoin`), they wait until joint
    states surround the stamp (`PostureJoin`, or `PatientQueue`), and where a node asks for several
    sets of one stamp, they are dispatched in the order in which the node named them
    (`StampOrderedDispatcher`). So every run calls a node in the same order, whatever the order
    in which the messages arrive.

    A set whose posture never becomes known is dropped, and the node's health reports it. With
    `patience_s` [s] it is called all the same, without a posture, after that time: for a camera
    that may stand still. `is_calibrated` then holds sets back as well, for as long, and so does
    `must_wait` for as long as it returns True of a stamp [ns] and the time waited [s].
    """

    def __init__(
        self,
        node: GraphNode,
        joints: JointCodec | None = None,
        *,
        joints_expected_every_s: float = 2.0,
        patience_s: float | None = None,
        is_calibrated: Callable[[], bool] = lambda: True,
        must_wait: Callable[[int, float], bool] = lambda stamp_ns, waited_s: False,
    ) -> None:
        """`joints`: decodes the joint states; None: the callbacks need no posture."""
        self._node = node
        self._postures: PostureReader | None = None
        self._is_calibrated, self._must_wait = is_calibrated, must_wait
        self._history = PostureHistory()
        self._patient: PatientQueue[tuple[Callback, StampedSet]] | None = None
        self._joins: list[StampJoin] = []
        self._callbacks: list[Callback] = []
        self._dispatcher: StampOrderedDispatcher | None = None  # one set needs no order
        if joints is not None:
            self._postures = PostureReader(joints, joints_expected_every_s)
            self._history = self._postures.history
            receive = partial(self._on_joint_states, self._postures)
            node.subscribe(JOINT_STATES, receive, joints_expected_every_s)
        self._strict: PostureJoin[tuple[Callback, StampedSet]] = PostureJoin(self._history)
        if patience_s is not None:
            self._patient = PatientQueue(self._history, patience_s)
            # Steady time: this is for the case that the other messages do not come.
            steady = Clock(clock_type=ClockType.STEADY_TIME)
            node.create_timer(_PATIENCE_CHECKED_EVERY_S, self.call_ready, clock=steady)

    @property
    def newest_posture(self) -> Posture | None:
        """Return the latest posture of which both joints are measured: to hold the head there."""
        return self._history.newest

    @property
    def history(self) -> PostureHistory:
        """Return the postures of the last seconds, which stays the same object."""
        return self._history

    @property
    def waits_for_posture(self) -> bool:
        """Return whether a set waits for the joint states of its time."""
        return len(self._strict) + len(self._patient or ()) > 0

    def missing_topics(self) -> frozenset[str]:
        """Return the names of the topics that the newest incomplete set still lacks."""
        return frozenset().union(*(join.missing() for join in self._joins))

    def call_with(
        self,
        decoders: Mapping[Topic, Callable[[Any], Any]],
        callback: Callback,
        *,
        also: Mapping[Topic, Callable[[Any], Any]] | None = None,
        also_which: Callable[[Any], Collection[Topic]] = lambda _: (),
        expected_every_s: float | None = 2.0,
    ) -> None:
        """Call `callback` with one message of each topic of a stamp, decoded by its decoder.

        `also`: further topics that belong to the set of some stamps only: those that
        `also_which` returns for the value of the first topic. `expected_every_s` [s]: silence of a
        topic of `decoders` for longer is a warning. Sets that are asked for first are called
        first. A decoder raises ValueError for a message that cannot be used.
        """
        index = len(self._callbacks)
        self._callbacks.append(callback)
        if index:
            self._dispatcher = StampOrderedDispatcher([str(i) for i in range(index + 1)])
        first, *_ = decoders
        base = StampJoin([topic.name for topic in decoders])
        # What a message of `also` belongs to is known only when the others have come.
        wholes: dict[frozenset[str], StampJoin] = {}
        for count in range(1, len(also or {}) + 1):
            for some in combinations(also or {}, count):
                names = [topic.name for topic in (*decoders, *some)]
                wholes[frozenset(topic.name for topic in some)] = StampJoin(names)
        self._joins.append(base)
        topics = {topic.name: topic for topic in (*decoders, *(also or {}))}

        def complete(message: Any, stamp_ns: int, found: Mapping[str, Any]) -> None:
            values = {topics[name]: value for name, value in found.items()}
            self._queue(index, StampedSet(message.header, stamp_ns, values))

        def collect(topic: Topic, decode: Callable[[Any], Any], message: Any) -> None:
            stamp_ns, value = to_ns(message.header.stamp), decode(message)
            if topic in decoders:
                found = base.collect_value(topic.name, stamp_ns, value)
                if found is None:
                    return
                which = frozenset(each.name for each in also_which(found[first.name]))
                if not which:
                    complete(message, stamp_ns, found)
                    return
                joins = [wholes[which]]
            else:
                found = {topic.name: value}
                joins = [join for names, join in wholes.items() if topic.name in names]
            for join in joins:
                for name, each in found.items():
                    joined = join.collect_value(name, stamp_ns, each)
                    if joined is not None:
                        complete(message, stamp_ns, joined)

        for topic, decode in decoders.items():
            self._node.subscribe(topic, partial(collect, topic, decode), expected_every_s)
        for topic, decode in (also or {}).items():
            self._node.subscribe(topic, partial(collect, topic, decode))

    def _queue(self, index: int, found: StampedSet) -> None:
        if self._postures is None:
            self._dispatch(index, found)
            return
        item = (partial(self._dispatch, index), found)
        if self._patient is None:
            self._strict.queue_item(found.stamp_ns, item)
        else:
            self._patient.queue_item(found.stamp_ns, item, time.monotonic())
        self.call_ready()

    def _dispatch(self, index: int, found: StampedSet) -> None:
        call = partial(self._callbacks[index], found)
        if self._dispatcher is None:
            call()
        else:
            self._dispatcher.queue_action(str(index), found.stamp_ns, call)

    def call_ready(self) -> None:
        """Call the sets whose waiting is over; for a node that has got what they wait for."""
        if self._patient is not None:
            for (call, found), _, posture in self._patient.pop_ready(
                self._is_calibrated(), time.monotonic(), self._must_wait
            ):
                if posture is None:
                    self._report_late_joints(found.stamp_ns)
                call(replace(found, posture_or_none=posture))
            return
        for (call, found), posture in self._strict.pop_ready():
            if posture is None:
                text = 'no joint state for the stamp of an image: skipped'
                self._node.report_problem(
                    'posture', f'{text}; {self._why_unknown(found.stamp_ns)}'
                )
            else:
                call(replace(found, posture_or_none=posture))

    def _why_unknown(self, stamp_ns: int) -> str:
        return '' if self._postures is None else self._postures.explain_unknown(stamp_ns)

    def _report_late_joints(self, stamp_ns: int) -> None:
        """Report an image that went on without a posture although joint states come."""
        newest_ns = self._history.newest_stamp_ns
        if newest_ns is not None and newest_ns < stamp_ns:
            text = 'an image did not wait longer for the joint states of its time'
            why = self._why_unknown(stamp_ns)
            self._node.report_problem('posture', f'{text}; {why}', Level.WARN)

    def _on_joint_states(self, postures: PostureReader, message: JointState) -> None:
        now_s = time.monotonic()
        try:
            postures.record_message(message, now_s)
        finally:
            postures.report_joints(self._node, now_s)
        self.call_ready()
