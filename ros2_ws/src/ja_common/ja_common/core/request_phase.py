"""What happens in a meeting with a real caregiver, in the words of `caregiver/request`."""

from enum import Enum


class RequestPhase(Enum):
    """What the meeting waits for."""

    STARTING = 'starting'
    NO_PERSON = 'no_person'
    CAMERA = 'camera'
    THING = 'thing'
    ANSWER = 'answer'
    REARRANGE = 'rearrange'
    PAUSED = 'paused'
    ENDED = 'ended'
