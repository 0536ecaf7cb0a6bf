"""The values of a DiagnosticStatus, by key."""

from diagnostic_msgs.msg import DiagnosticStatus


def status_values(status: DiagnosticStatus) -> dict[str, str]:
    """Return the values of a status by their keys."""
    return {pair.key: pair.value for pair in status.values}
