"""`caregiver/request` on the wire: what the page shows of a meeting."""

from typing import Protocol

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from ja_caregiver.core.meeting import Meeting, MeetingTrial
from ja_caregiver.core.numbered_things import Direction
from ja_caregiver.core.requests import RequestConfig
from ja_common.core.health import Level
from ja_common.core.request_phase import RequestPhase

_WITH_ANSWER = (RequestPhase.ANSWER, RequestPhase.CAMERA, RequestPhase.REARRANGE)


class CourseState(Protocol):
    """What is published of the course of a meeting, with a person or with a film."""

    config: RequestConfig
    phase: RequestPhase
    asked: int | None

    @property
    def last(self) -> MeetingTrial | None:
        """Return the last trial with an answer."""
        ...

    @property
    def trials_done(self) -> int:
        """Return how many trials have an answer."""
        ...

    @property
    def message(self) -> str:
        """Return the sentence for the person."""
        ...


def encode_request(
    name: str, course: CourseState, meeting: Meeting, things: dict[int, Direction], report: str
) -> DiagnosticStatus:
    """Return the state of a meeting with this node name; `report`: its path, '' before the end."""
    phase, last = course.phase, course.last
    shows_answer = phase in _WITH_ANSWER and last is not None
    number: int | None = None
    if phase is RequestPhase.THING:
        number = course.asked
    elif phase is RequestPhase.ANSWER and last is not None:
        number = last.asked
    # The trial under way; between two trials the last one that has ended.
    under_way = phase not in (RequestPhase.ANSWER, RequestPhase.REARRANGE, RequestPhase.ENDED)
    trial = min(course.trials_done + under_way, course.config.trials)
    learner = meeting.learner_rate()
    low, high = learner.interval
    values = {
        'phase': phase.value,
        'number': _text(number),
        'trial': str(trial),
        'trials': str(course.config.trials),
        'answer': _text(last.fixated) if shows_answer and last is not None else '',
        'right': str(last.success).lower() if shows_answer and last is not None else '',
        'learner_successes': str(learner.successes),
        'learner_trials': str(learner.trials),
        'learner_interval': f'{low:.4f} {high:.4f}',
        'successes': str(meeting.success_rate().successes),
        'chance': f'{meeting.chance():.4f}',
        'things': ';'.join(f'{n} {pan:.4f} {tilt:.4f}' for n, (pan, tilt) in things.items()),
        'report': report,
        'film': str(meeting.source == 'film').lower(),
    }
    waits = phase in (RequestPhase.PAUSED, RequestPhase.NO_PERSON)
    return DiagnosticStatus(
        level=bytes([Level.WARN if waits else Level.OK]),
        name=name,
        message=course.message,
        hardware_id=name.rpartition('/')[0] or '/',
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )


def _text(number: int | None) -> str:
    return '' if number is None else str(number)
