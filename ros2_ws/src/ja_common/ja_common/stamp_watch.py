"""Whether a sensor stamps its messages, and by the clock of this node."""

from collections.abc import Callable
from typing import Any

from ja_common.core.stamps import NS_PER_S
from ja_common.time_codec import to_ns
from ja_common.topics import (
    DEPTH,
    IMAGE,
    IMAGE_COMPRESSED,
    JOINT_STATES,
    RIGHT_IMAGE,
    WIDE_IMAGE,
    Topic,
)

OTHER_CLOCK_S = 60.0
"""No message is under way for so long [s]: what is stamped this far off has another clock."""

_FROM_SENSORS = (IMAGE, IMAGE_COMPRESSED, WIDE_IMAGE, DEPTH, RIGHT_IMAGE, JOINT_STATES)


def watch_stamps(
    topic: Topic, now_ns: Callable[[], int | None], report: Callable[[str], None]
) -> Callable[[Any], None]:
    """Return a callback for every message of a topic; `report` gets what is wrong with its stamp.

    `now_ns`: the clock of the node, None where it does not matter. The first message of a
    simulation may have the time 0, so one alone is not reported. Topics of our own nodes repeat
    the stamps of the sensors, and are not watched.
    """
    if topic not in _FROM_SENSORS:
        return lambda message: None
    was_zero = False

    def check(message: Any) -> None:
        nonlocal was_zero
        stamp_ns = to_ns(message.header.stamp)
        if stamp_ns == 0 and was_zero:
            report(
                'the messages carry no time (header.stamp is 0): let the driver stamp them with '
                'the time of the measurement; without it images and postures cannot be joined'
            )
        elif stamp_ns and (now := now_ns()) is not None:
            off_s = (stamp_ns - now) / NS_PER_S
            if abs(off_s) > OTHER_CLOCK_S:
                where = 'ahead of' if off_s > 0 else 'behind'
                report(
                    f'the messages are stamped {abs(off_s):.0f} s {where} the clock of this node: '
                    'set use_sim_time where a simulator or player publishes /clock, let the '
                    'driver stamp with the ROS clock, and synchronise the clocks of the machines'
                )
        was_zero = stamp_ns == 0

    return check
