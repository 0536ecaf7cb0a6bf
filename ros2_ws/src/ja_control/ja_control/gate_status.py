"""The status message of the gate: its decision, and why it holds the head."""

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ja_common.core.health import Level
from ja_control.core.attention_cycle import AttentionCycle, Decision
from ja_control.core.hold import Hold


def describe_unseen(cycle: AttentionCycle) -> str | None:
    """Return in a sentence that no person is seen, and for how long; None while one is."""
    if cycle.unseen_s == 0.0 or cycle.unseen_s < cycle.config.search_after_s:
        return None
    return f'I see no person to look at, for {cycle.unseen_s:.0f} s'


def encode_gate_status(
    name: str,
    cycle: AttentionCycle,
    *,
    enabled: bool,
    clamped: str,
    hold: Hold | None,
    decision: Decision | None,
) -> DiagnosticStatus:
    """Return the status of the gate with this node name.

    `clamped` names the limits that cut the motion. `decision` is None between two images: the
    values `source`, `p_lm` and `shifts` are then left out. `unseen_s` is the time for which there
    was no person to look at [s]; the message states it from `search_after_s` on.
    """
    values = {
        'trials': str(cycle.trials),
        'enabled': str(enabled),
        'phase': cycle.phase.value,
        'unseen_s': f'{cycle.unseen_s:.1f}',
    }
    level, message = Level.OK, cycle.phase.value
    if (unseen := describe_unseen(cycle)) is not None:
        message += f': {unseen}'
    if hold is not None:
        level, message = hold.level, f'hold: {hold.text}'
        values['reason'] = hold.text
    if decision is not None:
        values |= {
            'phase': decision.phase.value,
            'source': decision.source.value,
            'p_lm': f'{decision.p_lm:.4f}',
            'shifts': str(decision.shifts),
        }
    values['clamped'] = clamped
    return DiagnosticStatus(
        level=bytes([level]),
        name=name,
        message=message,
        hardware_id=name.rpartition('/')[0] or '/',  # the namespace: one head each
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
