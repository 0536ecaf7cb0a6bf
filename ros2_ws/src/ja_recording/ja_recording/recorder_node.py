"""`recorder`: writes every topic of the graph, of any type, to a folder of MCAP files."""

import re
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.health import Level
from ja_common.core.run_folder import new_run_folder
from ja_common.graph_node import GraphNode
from ja_common.message_types import message_class, schema_of
from ja_common.node_main import spin_node
from ja_common.qos_text import common_profile, offered_text
from ja_common.topics import NEW_NAMES, Topic
from ja_recording.background_writer import BackgroundWriter, QueuedMessage
from ja_recording.core.default_exclude import DEFAULT_EXCLUDE
from ja_recording.recorded_origin import origin_text, origin_topic
from ja_recording.recording_folder import Channel, Limits, RecordingFolder

_POLL_PERIOD_S = 0.2
_QUEUE_DEPTH = 200


@dataclass(frozen=True)
class RecorderConfig(Configuration):
    """The topics to record, the folder, and how much of the recording to keep."""

    folder: str = parameter('', 'folder of the recording; empty: runs/<time>-record')
    exclude: str = parameter(
        DEFAULT_EXCLUDE, 'regular expression: topics that it matches anywhere are left out'
    )
    split_mb: float = parameter(256.0, 'begin a new file beyond so many MB; 0: never', low=0.0)
    split_s: float = parameter(600.0, 'begin a new file after so many seconds; 0: never', low=0.0)
    keep_mb: float = parameter(
        4000.0, 'drop the oldest files beyond so many MB in all; 0: keep all', low=0.0
    )
    keep_s: float = parameter(0.0, 'drop files older than so many seconds; 0: keep all', low=0.0)
    queue_mb: float = parameter(64.0, 'messages that may wait for the disk', low=1.0, high=4000.0)


class RecorderNode(GraphNode):
    """A subscriber to the raw bytes of all topics, with a thread that writes them; no decoding."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('recorder', **node_kwargs)
        config = self.configure(RecorderConfig)
        try:
            self._exclude = re.compile(config.exclude) if config.exclude else None
        except re.error as error:
            raise ConfigError(f'exclude = {config.exclude!r}: {error}') from None
        given = Path(config.folder).expanduser() if config.folder else None
        self.folder = given or new_run_folder('record')
        limits = Limits(config.split_mb, config.split_s, config.keep_mb, config.keep_s)
        self._recording = RecordingFolder(self.folder, limits)
        self.writer = BackgroundWriter(self._recording, int(config.queue_mb * 1e6))
        self._began_s = time.monotonic()
        self._began_ns = time.time_ns()
        self._known: set[str] = set()
        self.create_timer(
            _POLL_PERIOD_S, self._poll_graph, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        self.get_logger().info(f'recording into {self.folder}')

    @property
    def elapsed_s(self) -> float:
        """Return the time since the recording began [s]."""
        return time.monotonic() - self._began_s

    @property
    def topics(self) -> int:
        """Return the number of recorded topics."""
        return len(self._known)

    def destroy_node(self) -> None:
        """Close the recording, then destroy the node."""
        self.writer.close()
        super().destroy_node()

    def _poll_graph(self) -> None:
        """Subscribe to the new topics of the graph; update the health of the writer."""
        present = dict(self.get_topic_names_and_types())
        for name, types in present.items():
            excluded = self._is_excluded(name) or _is_old_name(name, present)
            if name not in self._known and not excluded:
                self._subscribe_raw(name, types)
        self.health.values |= {
            'folder': str(self.folder),
            'topics': str(len(self._known)),
            'messages written': str(self.writer.written),
            'messages dropped': str(self.writer.dropped),
        }
        if self.writer.failure:
            self.report_problem('writing', self.writer.failure)
        elif self.writer.dropped:
            text = f'the disk is too slow: {self.writer.dropped} messages were dropped'
            self.report_problem('writing', text, Level.WARN)

    def _is_excluded(self, name: str) -> bool:
        hidden = any(part.startswith('_') for part in name.split('/'))
        return hidden or bool(self._exclude and self._exclude.search(name))

    def _subscribe_raw(self, name: str, types: list[str]) -> None:
        publishers = self.get_publishers_info_by_topic(name)
        if not publishers:
            return  # no publisher yet: its quality of service is not known
        self._known.add(name)
        try:
            if len(types) > 1:
                raise ConfigError(f'it has several types ({", ".join(types)})')
            schema_of(types[0])
            kind = message_class(types[0])
        except ConfigError as error:
            self.report_problem(name, f'{name} is not recorded: {error}', Level.WARN)
            return
        offered = [publisher.qos_profile for publisher in publishers]
        channel = Channel(
            name, types[0], offered_text(offered), str(publishers[0].topic_type_hash)
        )
        # As strict as all the publishers allow, and no stricter: then every one of them matches.
        profile = common_profile(
            reliable=all(p.reliability is ReliabilityPolicy.RELIABLE for p in offered),
            latched=all(p.durability is DurabilityPolicy.TRANSIENT_LOCAL for p in offered),
            depth=_QUEUE_DEPTH,
        )
        self.create_subscription(
            kind,
            name,
            self._writer_callback(channel),
            profile,
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )

    def _writer_callback(self, channel: Channel) -> Callable[[bytes, Any], None]:
        queue_message = self.writer.queue_message
        origin = origin_topic(channel.topic, channel.type_name)

        def on_message(data: bytes, info: Any) -> None:
            # Ordered by the time of publication, not of arrival. A latched message is older than
            # the recording: it comes first.
            sent_ns = info['source_timestamp'] or time.time_ns()
            stamp_ns = max(sent_ns, self._began_ns)
            if origin is not None:
                self.call_guarded(channel.topic, self._note_origin, channel.topic, origin, data)
            queue_message(
                QueuedMessage(
                    channel, data, stamp_ns, sent_ns, info['publication_sequence_number'] or 0
                )
            )

        return on_message

    def _note_origin(self, name: str, topic: Topic, data: bytes) -> None:
        """Keep in metadata.yaml what learner and eyes started from: a split file may lack it."""
        self._recording.custom_data[name] = origin_text(topic, data)


def _is_old_name(name: str, present: Collection[str]) -> bool:
    """Return whether a topic has what another topic has under its new name."""
    return any(
        name.endswith(f'/{old}') and f'{name.removesuffix(old)}{new}' in present
        for old, new in NEW_NAMES.items()
    )


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(RecorderNode, args)


if __name__ == '__main__':
    main()
