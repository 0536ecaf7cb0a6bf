"""The course of a meeting: camera, thing, answer; pauses, absences, rearrangements."""

from dataclasses import dataclass, field

import pytest

from ja_caregiver.core.request_draw import RequestDraw
from ja_caregiver.core.requests import (
    GateState,
    MeetingImage,
    RequestConfig,
    RequestCourse,
)
from ja_common.core.request_phase import RequestPhase

THINGS = {1: (0.3, 0.1), 2: (0.0, 0.15), 3: (-0.3, 0.1)}
PERIOD_NS = 10**8


@dataclass
class Meeting:
    """A robot before a person, image after image; the gate's status follows each image."""

    config: RequestConfig
    things: dict = field(default_factory=lambda: dict(THINGS))
    face: bool = True

    def __post_init__(self):
        draw = RequestDraw(1)
        self.course = RequestCourse(self.config, draw.draw, draw.restart)
        self.stamp_ns, self.gate_trials, self.trials = 10**9, 0, []
        self.phases = []

    def image(self, gate='look', count=1, attended=None, source='', **more):
        """Take images of a gate in this phase; return the course's phase."""
        for _ in range(count):
            self.stamp_ns += PERIOD_NS
            looks = gate == 'look' and self.face
            trial = self.course.observe_image(
                MeetingImage(
                    self.stamp_ns,
                    face_seen=looks,
                    attended=looks if attended is None else attended,
                    things=dict(self.things),
                    **more,
                )
            )
            if trial is not None:
                self.trials.append(trial)
            self.course.observe_gate(GateState(gate, self.gate_trials, source))
            self.phases.append(self.course.phase.value)
        return self.course.phase

    def to_request(self):
        """Go on until she is asked to look at a thing; return its number."""
        for _ in range(100):
            if self.image(proposal=None) is RequestPhase.THING:
                return self.course.asked
        raise AssertionError(f'no request: {self.course.message}')

    def answer(self, fixated=None, proposed=None, source='LM'):
        """Glance, shift to a thing and fixate it (or nothing); return the trial."""
        proposal = None if proposed is None else self.things[proposed]
        self.image(count=15, proposal=proposal)
        self.image('glance', 4, proposal=proposal)
        self.image('shift', 5, source=source)
        self.gate_trials += 1
        count = len(self.trials)
        place = None if fixated is None else self.things.get(fixated, (0.9, 0.9))
        self.image('look', 1, attended=False, fixation=place)
        self.image(count=6 if len(self.trials) == count else 0)
        assert len(self.trials) == count + 1, self.phases[-40:]
        return self.trials[-1]


@pytest.fixture
def meet():
    def make(**config):
        return Meeting(RequestConfig(**{'rearrange_every': 0, **config}))

    return make


def test_camera_thing_answer(meet):
    meeting = meet(camera_s=1.5, answer_s=1.0)
    assert meeting.image() is RequestPhase.CAMERA
    assert meeting.course.message == 'Look at the camera.'
    meeting.image(count=14)
    assert meeting.course.phase is RequestPhase.CAMERA
    asked = meeting.to_request()
    assert meeting.course.message == f'Look at thing {asked}.'
    trial = meeting.answer(fixated=asked, proposed=asked)
    assert (trial.asked, trial.proposed, trial.fixated) == (asked, asked, asked)
    assert trial.success
    assert trial.learner_right
    assert trial.followed_learner
    assert trial.things == THINGS
    assert meeting.course.message == f'I looked at thing {asked}: right.'
    meeting.image(count=9)
    assert meeting.course.phase is RequestPhase.ANSWER
    assert meeting.image(count=2) is RequestPhase.CAMERA


@pytest.mark.parametrize(
    ('fixated', 'proposed', 'source', 'expected'),
    [
        ('other', None, 'VF', (False, None, False)),
        ('asked', 'other', 'VF', (True, False, False)),
        (None, 'asked', 'LM', (False, True, True)),
        (99, 'asked', 'LM', (False, True, True)),  # something that has no number
    ],
)
def test_what_a_trial_holds(meet, fixated, proposed, source, expected):
    meeting = meet()
    asked = meeting.to_request()
    numbers = {'asked': asked, 'other': asked % 3 + 1}
    trial = meeting.answer(numbers.get(fixated, fixated), numbers.get(proposed), source)
    assert (trial.success, trial.learner_right, trial.followed_learner) == expected
    if trial.fixated is None:
        assert meeting.course.message == 'I found no thing.'


def test_the_fixation_may_come_before_or_after_the_status_that_ends_the_trial(meet):
    meeting = meet()
    for late in (0, 1, 3):
        asked = meeting.to_request()
        meeting.image(count=12)
        meeting.image('shift', 3)
        meeting.gate_trials += 1
        if late:
            meeting.image('look', late, attended=False)
        meeting.image('look', 1, attended=False, fixation=THINGS[asked])
        assert [trial.success for trial in meeting.trials][-1]
    assert len(meeting.trials) == 3


def test_several_shifts_are_one_trial(meet):
    meeting = meet()
    asked = meeting.to_request()
    meeting.image(count=12)
    for source in ('LM', 'VF', 'VF'):
        meeting.image('shift', 4, source=source)
        meeting.image('shift', 1)  # a status between two images states no source
    meeting.gate_trials += 1
    meeting.image(fixation=THINGS[asked], attended=False)
    assert len(meeting.trials) == 1
    assert not meeting.trials[0].followed_learner


def test_the_meeting_ends_after_its_trials_and_holds_the_head(meet):
    meeting = meet(trials=3)
    for _ in range(3):
        assert meeting.course.phase is not RequestPhase.ENDED
        meeting.answer(fixated=meeting.to_request())
    assert not meeting.course.ended
    meeting.image(count=12)
    assert meeting.course.ended == 'all requests were made'
    assert meeting.course.holds_head
    meeting.course.end('stopped')
    assert meeting.course.ended == 'all requests were made'
    meeting.image(count=50)
    meeting.course.pause(True)
    meeting.course.rearranged()
    assert meeting.course.phase is RequestPhase.ENDED
    assert meeting.course.trials_done == 3


def test_requests_wait_for_things(meet):
    meeting = meet()
    meeting.things = {1: (0.1, 0.1)}
    meeting.image(count=100)
    assert meeting.course.phase is RequestPhase.STARTING
    assert meeting.course.message == 'I look for things: 1 of at least 2.'
    meeting.things = dict(THINGS)
    # Late in a look she would be asked just before the head leaves.
    meeting.image(count=40)
    assert meeting.course.phase is RequestPhase.CAMERA
    meeting.image('shift', 3)
    meeting.to_request()


def test_the_camera_comes_first_however_long_the_head_needs(meet):
    meeting = meet()
    meeting.image(count=60, attended=False)
    assert meeting.course.phase is RequestPhase.CAMERA
    meeting.image(count=10)
    meeting.image(count=3, attended=False)  # the face jitters: she has looked long enough
    meeting.image(count=4)
    assert meeting.course.phase is RequestPhase.THING


def test_without_a_person_requests_wait_and_the_same_one_comes_again(meet):
    meeting = meet(no_person_after_s=2.0)
    asked = meeting.to_request()
    meeting.face = False
    meeting.image(count=19)
    assert meeting.course.phase is RequestPhase.THING
    meeting.image('search', 20)
    assert meeting.course.phase is RequestPhase.NO_PERSON
    assert meeting.course.message == 'I see no person.'
    assert not meeting.course.holds_head  # it searches
    meeting.image('search', 100)
    meeting.face = True
    assert meeting.image() is RequestPhase.CAMERA
    assert meeting.to_request() == asked
    assert meeting.course.trials_done == 0


def test_during_a_shift_her_face_may_be_out_of_view(meet):
    meeting = meet()
    meeting.to_request()
    meeting.image(count=12)
    meeting.image('glance', 30)
    assert meeting.course.phase is RequestPhase.THING
    meeting.image('shift', 60)
    assert meeting.course.phase is RequestPhase.THING


def test_a_pause_holds_the_head_and_repeats_the_request(meet):
    meeting = meet()
    asked = meeting.to_request()
    meeting.image(count=12)
    meeting.image('shift', 2)
    meeting.course.pause(True)
    assert meeting.course.holds_head
    assert meeting.course.message == 'Paused.'
    meeting.image(count=30, fixation=THINGS[asked])  # the gate is disabled
    assert meeting.course.trials_done == 0
    meeting.course.pause(False)
    assert not meeting.course.holds_head
    assert meeting.to_request() == asked
    meeting.course.pause(False)  # no pause: nothing changes
    assert meeting.course.phase is RequestPhase.THING


def test_she_is_asked_to_rearrange_and_the_meeting_waits(meet):
    meeting = meet(rearrange_every=2, rearrange_s=60.0)
    for _ in range(2):
        meeting.answer(fixated=meeting.to_request())
    meeting.image(count=12)
    assert meeting.course.phase is RequestPhase.REARRANGE
    assert meeting.course.holds_head
    meeting.image(count=500)
    assert meeting.course.phase is RequestPhase.REARRANGE
    meeting.course.rearranged()
    assert not meeting.course.holds_head
    assert meeting.course.asked is None
    meeting.things = {}
    assert meeting.image() is RequestPhase.STARTING
    meeting.things = dict(THINGS)
    meeting.answer(fixated=meeting.to_request())
    assert meeting.course.phase is RequestPhase.ANSWER
    meeting.image(count=12)
    assert meeting.course.phase is RequestPhase.CAMERA  # counted from the rearrangement


def test_a_rearrangement_that_is_not_confirmed_ends_after_its_time(meet):
    meeting = meet(rearrange_every=1, rearrange_s=5.0)
    meeting.answer(fixated=meeting.to_request())
    meeting.image(count=12 + 45)
    assert meeting.course.phase is RequestPhase.REARRANGE
    meeting.image(count=8)
    assert meeting.course.phase is not RequestPhase.REARRANGE


def test_things_rearranged_without_being_asked_withdraw_the_request(meet):
    meeting = meet()
    meeting.to_request()
    meeting.image(count=12)
    meeting.image('shift', 2)
    meeting.course.rearranged()
    meeting.gate_trials += 1
    meeting.image(count=10, fixation=THINGS[1])
    assert meeting.trials == []


def test_a_thing_that_disappears_is_not_asked_for_any_longer(meet):
    meeting = meet()
    asked = meeting.to_request()
    del meeting.things[asked]
    assert meeting.image() is RequestPhase.CAMERA
    meeting.image('shift', 3)
    assert meeting.to_request() != asked


def test_a_shift_before_she_could_turn_answers_nothing(meet):
    meeting = meet(least_look_s=1.0)
    for count in range(1, 4):
        asked = meeting.to_request()
        meeting.image(count=3)
        meeting.image('shift', 3)
        meeting.gate_trials += 1
        meeting.image(count=5, fixation=THINGS[asked])
        assert meeting.course.hurried == count
    assert meeting.trials == []
    meeting.answer(fixated=meeting.to_request())
    assert meeting.course.hurried == 0


def test_a_shift_that_the_gate_breaks_off_is_no_trial(meet):
    meeting = meet()
    asked = meeting.to_request()
    meeting.image(count=12)
    meeting.image('shift', 3)
    meeting.image('look', 3)  # held, then from the look again; its trials have not changed
    assert meeting.course.phase is RequestPhase.CAMERA
    assert meeting.to_request() == asked


def test_a_clock_set_back_does_not_stop_the_meeting(meet):
    meeting = meet()
    meeting.image(count=5)
    meeting.stamp_ns = 10**8
    asked = meeting.to_request()
    meeting.image(count=5)
    meeting.stamp_ns = 10**8
    assert meeting.answer(fixated=asked).success
    meeting.stamp_ns = 10**8
    meeting.image(count=15)
    assert meeting.course.phase is RequestPhase.CAMERA
