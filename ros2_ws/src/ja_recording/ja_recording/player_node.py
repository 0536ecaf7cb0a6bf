"""`player`: publishes a recording on its own topics, with /clock, at any speed."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.graph_node import GraphNode
from ja_common.message_types import message_class
from ja_common.node_main import spin_node
from ja_common.qos_text import common_profile, profile_of
from ja_common.ros_defaults import ros_distro
from ja_common.time_codec import to_time
from ja_common.topics import CLOCK, Topic
from ja_recording.core.reader import RecordedMessage, RecordedTopic, Recording

_TIMER_PERIOD_S = 0.001
# A recorder whose clock was set, or that had no /clock yet, leaves gaps of years.
_LONGEST_GAP_NS = 3600 * 10**9
_UNKNOWN_QOS_DEPTH = 10


@dataclass(frozen=True)
class PlayerConfig(Configuration):
    """The recording to play, and its speed."""

    recording: str = parameter(
        '', 'a file (.mcap, .db3), or a folder of rosbag2; it must be given'
    )
    speed: float = parameter(1.0, 'seconds of the recording a second', low=0.001, high=1000.0)
    without: str = parameter('', 'topics to leave out, with commas between')
    start_after_s: float = parameter(
        1.0, 'time for the others to find the player before it begins', low=0.0, high=3600.0
    )


class PlayerNode(GraphNode):
    """A publisher of the recorded bytes, each when it is due.

    If the recording holds /clock (a simulation), that clock is played. Otherwise /clock is the
    time at which the messages were published. Both suit nodes with `use_sim_time`.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('player', **node_kwargs)
        config = self.configure(PlayerConfig)
        if not config.recording:
            raise ConfigError('the parameter recording is empty: name the recording to play')
        self.recording = Recording(Path(config.recording).expanduser(), config.without.split(','))
        self._speed = config.speed
        self._skipped_ns = 0
        for remark in self.recording.remarks:
            self.get_logger().warning(remark)
        self._publisher_of: dict[str, Any] = {}
        for topic in self.recording.topics.values():
            self._make_publisher(topic)
        if self.recording.topics and not self._publisher_of:
            raise ConfigError(
                f'{config.recording}: no topic of it can be published; install the message types '
                'that the warnings above name'
            )
        self._makes_clock = CLOCK.name not in self._publisher_of
        if self._makes_clock:
            self._clock_publisher = self.create_topic_publisher(CLOCK)
        self._messages = self.recording.messages(self._publisher_of.keys())
        self._next: RecordedMessage | None = next(self._messages, None)
        self._began_s = time.monotonic() + config.start_after_s
        self.played = 0
        steady = RosClock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_TIMER_PERIOD_S, self._publish_due, clock=steady)

    @property
    def position_s(self) -> float:
        """Return the position in the recording [s]; negative before it begins."""
        return (time.monotonic() - self._began_s) * self._speed

    @property
    def length_s(self) -> float:
        """Return how long the recording is [s], without the gaps that were skipped so far."""
        span_ns = self.recording.last_ns - self.recording.first_ns
        return 1e-9 * (span_ns - self._skipped_ns)

    @property
    def done(self) -> bool:
        """Return whether every message has been published."""
        return self._next is None

    def _make_publisher(self, topic: RecordedTopic) -> None:
        """Make the publisher of a topic, or warn why it is left out: others do not wait for it."""
        try:
            kind = message_class(topic.type_name)
        except ConfigError as error:
            text = f'{topic.name} is left out: {error}'
            if '/msg/' in topic.type_name:
                package = topic.type_name.partition('/')[0].replace('_', '-')
                text += (
                    f'. Install ros-{ros_distro()}-{package}, or source the workspace that has it'
                )
            self.get_logger().warning(f'{text}; `--without {topic.name}` leaves it out unasked')
            return
        qos = self._profile(topic)
        self._publisher_of[topic.name] = self.create_topic_publisher(
            Topic(topic.name, kind, 'recorded', publisher_qos=qos, subscriber_qos=qos)
        )

    def _profile(self, topic: RecordedTopic) -> QoSProfile:
        if topic.offered_qos:
            try:
                return profile_of(topic.offered_qos)
            except ConfigError as error:
                self.get_logger().warning(
                    f'the quality of service of {topic.name} cannot be read: {error}'
                )
        # Old recorders did not keep it: what every subscriber can match, latched or not.
        return common_profile(reliable=True, latched=True, depth=_UNKNOWN_QOS_DEPTH)

    def _publish_due(self) -> None:
        now_ns = self._now_ns()
        if self._makes_clock and self.position_s >= 0:
            self._clock_publisher.publish(Clock(clock=to_time(now_ns)))
        while self._next is not None and self._next.stamp_ns <= now_ns:
            message = self._next
            # Before it is published: a message that cannot be must not come again for ever.
            self._next = next(self._messages, None)
            self._publisher_of[message.topic.name].publish(message.data)
            self.played += 1
            if self._next is not None:
                self._skip_gap(message.stamp_ns, self._next)

    def _now_ns(self) -> int:
        return self.recording.first_ns + self._skipped_ns + int(self.position_s * 1e9)

    def _skip_gap(self, last_ns: int, following: RecordedMessage) -> None:
        gap_ns = following.stamp_ns - last_ns
        if gap_ns > _LONGEST_GAP_NS:
            self._skipped_ns += gap_ns
            self.get_logger().warning(
                f'{1e-9 * gap_ns:.0f} s without a message are skipped: from {1e-9 * last_ns:.3f} '
                f'to {1e-9 * following.stamp_ns:.3f} s. The clock of the recorder was set, or '
                'messages were recorded before the first /clock (time 0)'
            )


class _EndingPlayer(PlayerNode):
    """A player that ends its process after the last message."""

    def _publish_due(self) -> None:
        super()._publish_due()
        if self.done:
            self.context.try_shutdown()


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(_EndingPlayer, args)


if __name__ == '__main__':
    main()
