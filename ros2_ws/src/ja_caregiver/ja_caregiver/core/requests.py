"""The course of a meeting: what the person is asked, when, and what her trials were.

'Look at the camera.', then 'Look at thing 3.', then the answer. The gate's cycle times it all: the
head looks at her for its dwell time, and the request comes early in it. So she has turned when the
head shifts, and the robot needs to know nothing of any request.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field

from ja_caregiver.core.meeting import MeetingTrial
from ja_caregiver.core.numbered_things import Direction, nearest_thing
from ja_common.core.config import Configuration, parameter
from ja_common.core.request_phase import RequestPhase
from ja_common.core.stamps import NS_PER_S

LOOKING = ('look', 'search', 'home')
"""Phases of the gate in which it wants to see a face."""

_SHIFTING, _LEARNER = 'shift', 'LM'
# The fixation of an image may come after the gate's status on it.
_FIXATION_WITHIN_S = 0.5
# Where requests start later in a look than after the answer, too little of it would be left.
_LATE_AFTER_S = 0.3


@dataclass(frozen=True)
class RequestConfig(Configuration):
    """Numbers and times of a meeting."""

    trials: int = parameter(40, 'requests with an answer, after which it ends', low=1, high=100000)
    camera_s: float = parameter(
        1.5, 'how long she looks at the camera before a request', low=0.0, high=60.0
    )
    least_look_s: float = parameter(
        1.0, 'a shift that starts sooner after the request answers nothing', low=0.0, high=60.0
    )
    answer_s: float = parameter(1.0, 'how long an answer is shown', low=0.0, high=60.0)
    rearrange_every: int = parameter(
        5, 'requests after which she is asked to move the things about; 0: never',
        low=0, high=100000,
    )  # fmt: skip
    rearrange_s: float = parameter(
        60.0, 'longest time for that: then the meeting goes on', low=1.0, high=3600.0
    )
    no_person_after_s: float = parameter(
        2.0, 'time without a face after which there is no person', low=0.1, high=60.0
    )
    least_things: int = parameter(2, 'things that a request needs', low=1, high=100)
    fixated_within_rad: float = parameter(
        0.1, 'a fixation farther than this from every thing is of none', low=0.01, high=0.5
    )


@dataclass(frozen=True)
class MeetingImage:
    """What the scorer knows of one image.

    `things`: by number. `proposal`: direction [rad] that the learner proposes, `fixation`: of the
    object that was fixated; None where there is none. `attended`: the head rests on her face.
    """

    stamp_ns: int
    face_seen: bool
    attended: bool
    things: dict[int, Direction]
    proposal: Direction | None = None
    fixation: Direction | None = None


@dataclass(frozen=True)
class GateState:
    """What the gate reports: its phase and trials, and the source of a decision ('': none)."""

    phase: str
    trials: int
    source: str = ''


@dataclass
class _Shift:
    stamp_ns: int
    asked: int
    things: dict[int, Direction]
    proposed: int | None
    trials_before: int
    followed_learner: bool = False
    over: bool = False


@dataclass
class RequestCourse:
    """The state of a meeting; give it every image and every state of the gate.

    `draw` chooses the next thing among numbers, and `restart_draw` is called when the numbers
    stand for other things. A request that was not answered (she left, or paused) is made again.
    """

    config: RequestConfig
    draw: Callable[[Collection[int]], int]
    restart_draw: Callable[[], None] = lambda: None
    phase: RequestPhase = field(default=RequestPhase.STARTING, init=False)
    asked: int | None = field(default=None, init=False)
    last: MeetingTrial | None = field(default=None, init=False)
    ended: str = field(default='', init=False)
    trials_done: int = field(default=0, init=False)
    hurried: int = field(default=0, init=False)
    """Shifts in a row that started before she could have turned."""

    def __post_init__(self) -> None:
        self._gate = GateState('', 0)
        self._things: dict[int, Direction] = {}
        self._proposal: Direction | None = None
        self._shift: _Shift | None = None
        self._over_ns: int | None = None
        self._stamp_ns = 0
        self._since_ns: int | None = None
        self._face_ns: int | None = None
        self._look_ns: int | None = None
        self._since_rearranged = 0

    @property
    def holds_head(self) -> bool:
        """Return whether the head must wait: nothing that it does now would be a trial."""
        return self.phase in (RequestPhase.PAUSED, RequestPhase.REARRANGE, RequestPhase.ENDED)

    @property
    def message(self) -> str:
        """Return the sentence that she reads."""
        found, needed = len(self._things), self.config.least_things
        return {
            RequestPhase.STARTING: f'I look for things: {found} of at least {needed}.',
            RequestPhase.NO_PERSON: 'I see no person.',
            RequestPhase.CAMERA: 'Look at the camera.',
            RequestPhase.THING: f'Look at thing {self.asked}.',
            RequestPhase.ANSWER: self._answer(),
            RequestPhase.REARRANGE: 'Move the things to other places.',
            RequestPhase.PAUSED: 'Paused.',
            RequestPhase.ENDED: 'The meeting has ended.',
        }[self.phase]

    def _answer(self) -> str:
        last = self.last
        if last is None or last.fixated is None:
            return 'I found no thing.'
        return f'I looked at thing {last.fixated}: {"right" if last.success else "wrong"}.'

    def pause(self, pauses: bool) -> None:
        """Interrupt the meeting, or go on with it."""
        if pauses and self.phase is not RequestPhase.ENDED:
            self._enter(RequestPhase.PAUSED)
        elif not pauses and self.phase is RequestPhase.PAUSED:
            self._enter(RequestPhase.STARTING)

    def rearranged(self) -> None:
        """Start with new numbers: the things stand elsewhere."""
        self.asked, self._shift = None, None
        self._things = {}
        self._since_rearranged = 0
        self.restart_draw()
        if self.phase not in (RequestPhase.PAUSED, RequestPhase.ENDED):
            self._enter(RequestPhase.STARTING)

    def end(self, why: str) -> None:
        """End the meeting; the first reason stays."""
        if not self.ended:
            self.ended = why
            self._enter(RequestPhase.ENDED)

    def observe_gate(self, gate: GateState) -> None:
        """Take the gate's state: a shift answers the request, or is none of ours."""
        before, self._gate = self._gate, gate
        if gate.phase == _SHIFTING != before.phase:
            self._start_shift(gate)
        shift = self._shift
        if shift is None or shift.over:
            return
        if gate.trials > shift.trials_before:
            shift.over = True
        elif gate.phase != _SHIFTING:
            self._enter(RequestPhase.CAMERA)  # the gate has broken the shift off
        elif gate.source:
            shift.followed_learner = gate.source == _LEARNER

    def observe_image(self, image: MeetingImage) -> MeetingTrial | None:
        """Take one image; return the trial that it ends, without pictures."""
        self._stamp_ns = image.stamp_ns
        self._things = image.things
        if self.phase is RequestPhase.REARRANGE:
            if self._elapsed_s() >= self.config.rearrange_s:
                self.rearranged()
        elif not self.holds_head:
            self._time_look(image)
            return self._follow(image)
        return None

    def _time_look(self, image: MeetingImage) -> None:
        """Note since when the head has rested on her face, as the gate does."""
        if not (image.attended and self._gate.phase == LOOKING[0]):
            self._look_ns = None
        elif self._look_ns is None or self._look_ns > image.stamp_ns:
            self._look_ns = image.stamp_ns

    @property
    def _comes_too_late(self) -> bool:
        """Return whether too little is left of this look for a request: the next one will do.

        Also where the head does not rest on her face.
        """
        if self._look_ns is None:
            return True
        latest_s = self.config.answer_s + _LATE_AFTER_S
        return (self._stamp_ns - self._look_ns) / NS_PER_S > latest_s

    def _follow(self, image: MeetingImage) -> MeetingTrial | None:
        if self._shift is not None:
            return self._follow_shift(self._shift, image)
        if self.phase is RequestPhase.ANSWER:
            if self._elapsed_s() < self.config.answer_s:
                return None
            self._enter_after_answer()
        if self.holds_head:
            return None
        if self._misses_person(image):
            self._enter(RequestPhase.NO_PERSON)
        elif self.phase is RequestPhase.THING:
            self._elapsed_s()  # notes a clock that was set back
            self._proposal = image.proposal or self._proposal
            if self.asked not in image.things:
                self._withdraw()
        elif image.face_seen or self.phase is not RequestPhase.NO_PERSON:
            self._prepare(image)
        return None

    def _prepare(self, image: MeetingImage) -> None:
        """Ask her to look at the camera, and then at a thing."""
        enough = len(image.things) >= self.config.least_things
        wanted = RequestPhase.CAMERA if enough else RequestPhase.STARTING
        if self.phase is not wanted:
            self._enter(wanted)
        if not enough or self._gate.phase != LOOKING[0]:
            self._since_ns = None
        elif self._since_ns is None and self._comes_too_late:
            return
        elif self._elapsed_s() >= self.config.camera_s:
            if self.asked not in image.things:
                self.asked = self.draw(image.things)
            self._proposal = image.proposal
            self._enter(RequestPhase.THING)
            self._elapsed_s()  # from now on

    def _start_shift(self, gate: GateState) -> None:
        if self.phase is RequestPhase.CAMERA:
            self.hurried += 1
        if self.phase is not RequestPhase.THING or self.asked is None:
            return
        if self._elapsed_s() < self.config.least_look_s:
            self.hurried += 1
            self._enter(RequestPhase.CAMERA)
            return
        self.hurried = 0
        proposal = self._proposal
        proposed = None if proposal is None else nearest_thing(self._things, proposal)
        self._over_ns = None
        self._shift = _Shift(self._stamp_ns, self.asked, dict(self._things), proposed, gate.trials)

    def _follow_shift(self, shift: _Shift, image: MeetingImage) -> MeetingTrial | None:
        """Return the trial once it has led to a fixation, or was given up."""
        if image.fixation is None:
            if not shift.over:
                return None
            if self._over_ns is None or self._over_ns > image.stamp_ns:
                self._over_ns = image.stamp_ns
            if image.stamp_ns - self._over_ns < _FIXATION_WITHIN_S * NS_PER_S:
                return None
        fixated = None
        if image.fixation is not None:
            # Also among those that were first seen in this trial.
            known = {**shift.things, **image.things}
            fixated = nearest_thing(known, image.fixation, self.config.fixated_within_rad)
        self.trials_done += 1
        self._since_rearranged += 1
        self.last = MeetingTrial(
            self.trials_done,
            shift.stamp_ns,
            shift.asked,
            shift.things,
            shift.proposed,
            fixated,
            shift.followed_learner,
        )
        self.asked = None
        self._enter(RequestPhase.ANSWER)
        self._elapsed_s()
        return self.last

    def _enter_after_answer(self) -> None:
        every = self.config.rearrange_every
        if self.trials_done >= self.config.trials:
            self.end('all requests were made')
        elif every and self._since_rearranged >= every:
            self._enter(RequestPhase.REARRANGE)
            self._elapsed_s()
        else:
            self._enter(RequestPhase.CAMERA)

    def _withdraw(self) -> None:
        """Ask for another thing: this one is gone."""
        self.asked = None
        self._enter(RequestPhase.CAMERA)

    def _misses_person(self, image: MeetingImage) -> bool:
        if image.face_seen or self._gate.phase not in LOOKING:
            self._face_ns = image.stamp_ns
        if self._face_ns is None or self._face_ns > image.stamp_ns:
            self._face_ns = image.stamp_ns
        missing_s = (image.stamp_ns - self._face_ns) / NS_PER_S
        return missing_s >= self.config.no_person_after_s

    def _enter(self, phase: RequestPhase) -> None:
        if self.holds_head:
            self._look_ns = None  # the gate starts its look again
        self.phase, self._since_ns, self._shift = phase, None, None

    def _elapsed_s(self) -> float:
        """Return the time [s] in this phase, since this was first asked for."""
        if self._since_ns is None or self._since_ns > self._stamp_ns:
            self._since_ns = self._stamp_ns
        return (self._stamp_ns - self._since_ns) / NS_PER_S
