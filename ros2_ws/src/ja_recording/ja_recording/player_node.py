"""`player`: a recording on its own topics again, with /clock, at any speed."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rclpy.executors import ExternalShutdownException
from rosgraph_msgs.msg import Clock

from ja_common.core.config import ConfigError, parameter
from ja_common.graph_node import GraphNode, spin_node
from ja_common.message_types import message_class
from ja_common.qos_text import profile_of
from ja_common.time_codec import to_time
from ja_common.topics import CLOCK, Topic
from ja_recording.core.reader import RecordedMessage, RecordedTopic, Recording

_LOOK_EVERY_S = 0.001


@dataclass(frozen=True)
class PlayerConfig:
    """What is played, and how fast."""

    recording: str = parameter('', 'a .mcap file, or a folder of them; it must be given')
    speed: float = parameter(1.0, 'seconds of the recording a second', low=0.001, high=1000.0)
    without: str = parameter('', 'topics to leave out, with commas between')
    start_after_s: float = parameter(
        1.0, 'time for the others to find the player before it begins', low=0.0, high=3600.0
    )


class PlayerNode(GraphNode):
    """Publishes raw bytes when they are due.

    The clock is the recorded one where there was one (a simulation); otherwise it is the time at
    which the messages were said, so that nodes with `use_sim_time` live in the recording.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('player', **node_kwargs)
        config = self.configure(PlayerConfig)
        if not config.recording:
            raise ConfigError('the parameter recording is empty: which recording shall be played?')
        self.recording = Recording(Path(config.recording).expanduser())
        self._speed = config.speed
        chosen = chosen_topics(self.recording, config.without.split(','))
        self._makes_clock = CLOCK.name not in chosen
        self._said = {topic.name: self._publisher(topic) for topic in chosen.values()}
        if self._makes_clock:
            self._clock_publisher = self.create_topic_publisher(CLOCK)
        self._messages = self.recording.messages(set(chosen))
        self._next: RecordedMessage | None = next(self._messages, None)
        self._began_s = time.monotonic() + config.start_after_s
        self.played = 0
        steady = RosClock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_LOOK_EVERY_S, self._play, clock=steady)

    @property
    def position_s(self) -> float:
        """How far into the recording we are [s]; negative before it begins."""
        return (time.monotonic() - self._began_s) * self._speed

    @property
    def done(self) -> bool:
        """Whether everything has been said."""
        return self._next is None

    def _publisher(self, topic: RecordedTopic) -> Any:
        qos = profile_of(topic.offered_qos)
        kind = message_class(topic.type_name)
        return self.create_topic_publisher(
            Topic(topic.name, kind, 'recorded', publisher_qos=qos, subscriber_qos=qos)
        )

    def _play(self) -> None:
        now_ns = self.recording.first_ns + int(self.position_s * 1e9)
        if self._makes_clock and self.position_s >= 0:
            self._clock_publisher.publish(Clock(clock=to_time(now_ns)))
        while self._next is not None and self._next.stamp_ns <= now_ns:
            self._said[self._next.topic.name].publish(self._next.data)
            self.played += 1
            self._next = next(self._messages, None)


def chosen_topics(recording: Recording, without: list[str]) -> dict[str, RecordedTopic]:
    """The topics of a recording but for some. Raises ConfigError for one that is not in it."""
    names = {f'/{name.strip().lstrip("/")}' for name in without if name.strip()}
    unknown = sorted(names - recording.topics.keys())
    if unknown:
        there = ', '.join(sorted(recording.topics))
        raise ConfigError(f'no topic {", ".join(unknown)} in the recording; there are: {there}')
    return {name: topic for name, topic in recording.topics.items() if name not in names}


class _EndingPlayer(PlayerNode):
    """Ends its process after the last message."""

    def _play(self) -> None:
        super()._play()
        if self.done:
            raise ExternalShutdownException


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(_EndingPlayer, args)


if __name__ == '__main__':
    main()
