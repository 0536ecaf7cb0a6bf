"""`player`: publishes a recording on its own topics, with /clock, at any speed."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rosgraph_msgs.msg import Clock

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.graph_node import GraphNode
from ja_common.message_types import message_class
from ja_common.node_main import spin_node
from ja_common.qos_text import profile_of
from ja_common.time_codec import to_time
from ja_common.topics import CLOCK, Topic
from ja_recording.core.reader import RecordedMessage, RecordedTopic, Recording

_TIMER_PERIOD_S = 0.001


@dataclass(frozen=True)
class PlayerConfig(Configuration):
    """The recording to play, and its speed."""

    recording: str = parameter('', 'a .mcap file, or a folder of them; it must be given')
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
        self.recording = Recording(Path(config.recording).expanduser())
        self._speed = config.speed
        chosen = chosen_topics(self.recording, config.without.split(','))
        self._makes_clock = CLOCK.name not in chosen
        self._publisher_of = {topic.name: self._make_publisher(topic) for topic in chosen.values()}
        if self._makes_clock:
            self._clock_publisher = self.create_topic_publisher(CLOCK)
        self._messages = self.recording.messages(set(chosen))
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
    def done(self) -> bool:
        """Return whether every message has been published."""
        return self._next is None

    def _make_publisher(self, topic: RecordedTopic) -> Any:
        qos = profile_of(topic.offered_qos)
        kind = message_class(topic.type_name)
        return self.create_topic_publisher(
            Topic(topic.name, kind, 'recorded', publisher_qos=qos, subscriber_qos=qos)
        )

    def _publish_due(self) -> None:
        now_ns = self.recording.first_ns + int(self.position_s * 1e9)
        if self._makes_clock and self.position_s >= 0:
            self._clock_publisher.publish(Clock(clock=to_time(now_ns)))
        while self._next is not None and self._next.stamp_ns <= now_ns:
            message = self._next
            # Before it is published: a message that cannot be must not come again for ever.
            self._next = next(self._messages, None)
            self._publisher_of[message.topic.name].publish(message.data)
            self.played += 1


def chosen_topics(recording: Recording, without: list[str]) -> dict[str, RecordedTopic]:
    """Return the topics of a recording except those in `without`.

    Raises ConfigError for a name in `without` that the recording does not hold.
    """
    names = {f'/{name.strip().lstrip("/")}' for name in without if name.strip()}
    unknown = sorted(names - recording.topics.keys())
    if unknown:
        there = ', '.join(sorted(recording.topics))
        raise ConfigError(f'no topic {", ".join(unknown)} in the recording; it holds: {there}')
    return {name: topic for name, topic in recording.topics.items() if name not in names}


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
