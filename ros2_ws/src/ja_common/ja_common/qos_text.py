"""Quality of service as rosbag2 writes it into recordings (YAML, version 9), and back."""

from typing import Any

import yaml
from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from ja_common.core.config import ConfigError
from ja_common.core.safe_files import parse_yaml

_PLAY_DEPTH = 100


def qos_entry(profile: QoSProfile) -> dict[str, Any]:
    """Return one offered profile, in rosbag2's words."""
    return {
        'history': profile.history.name.lower(),
        'depth': profile.depth,
        'reliability': profile.reliability.name.lower(),
        'durability': profile.durability.name.lower(),
        'deadline': _time(profile.deadline),
        'lifespan': _time(profile.lifespan),
        'liveliness': profile.liveliness.name.lower(),
        'liveliness_lease_duration': _time(profile.liveliness_lease_duration),
        'avoid_ros_namespace_conventions': profile.avoid_ros_namespace_conventions,
    }


def offered_text(profiles: list[QoSProfile]) -> str:
    """Return the text of `offered_qos_profiles` in a channel's metadata."""
    return yaml.safe_dump([qos_entry(profile) for profile in profiles], sort_keys=False)


def common_profile(reliable: bool, latched: bool, depth: int = _PLAY_DEPTH) -> QoSProfile:
    """Return a profile for subscribing to a recorded topic, or for publishing it again."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def profile_of(text: str) -> QoSProfile:
    """Return the profile for playing a recorded topic, with its reliability and durability.

    Numbers, as rosbag2 wrote them before version 9, mean the same as the words. Raises ConfigError
    when the text, which comes from the recording, is something else.
    """
    offered = parse_yaml(text, 'offered_qos_profiles') or []
    wanted = {'reliability', 'durability'}
    if not isinstance(offered, list) or not all(
        isinstance(each, dict) and wanted <= each.keys() for each in offered
    ):
        raise ConfigError(f'offered_qos_profiles are no profiles: {text[:100]!r}')
    reliable = all(each['reliability'] in ('reliable', 1) for each in offered)
    latched = bool(offered) and all(
        each['durability'] in ('transient_local', 1) for each in offered
    )
    return common_profile(reliable, latched)


def _time(duration: Duration) -> dict[str, int]:
    seconds, nanoseconds = divmod(duration.nanoseconds, 10**9)
    return {'sec': seconds, 'nsec': nanoseconds}
