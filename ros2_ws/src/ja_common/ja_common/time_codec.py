"""Stamps on the wire: builtin_interfaces/Time to and from integer nanoseconds."""

from builtin_interfaces.msg import Time

from ja_common.core.stamps import NS_PER_S


def to_ns(time: Time) -> int:
    """Return a message's stamp in nanoseconds."""
    return time.sec * NS_PER_S + time.nanosec


def to_time(stamp_ns: int) -> Time:
    """Return a message's stamp for a time in nanoseconds."""
    return Time(sec=stamp_ns // NS_PER_S, nanosec=stamp_ns % NS_PER_S)
