"""What a status says, by name."""

from diagnostic_msgs.msg import DiagnosticStatus


def status_values(status: DiagnosticStatus) -> dict[str, str]:
    """The values of a status by their keys."""
    return {pair.key: pair.value for pair in status.values}
