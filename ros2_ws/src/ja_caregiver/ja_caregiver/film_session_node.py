"""`film_session`: a film of a person who follows a schedule, with a digital head, and the score.

The film, the head and the score are one node because all of them go from image to image: so a
session repeats bit for bit. What she looks at leaves this node for the page alone.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.clock import Clock as SteadyClock
from rclpy.clock import ClockType
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import Header, String
from std_srvs.srv import SetBool, Trigger

from ja_caregiver.core.film_clips import Clip, ClipReader, directions_of_places
from ja_caregiver.core.film_score import FilmImage, FilmScore
from ja_caregiver.core.film_session import FilmSession, FilmSessionConfig, SessionPhase
from ja_caregiver.core.meeting import Meeting, MeetingTrial
from ja_caregiver.core.meeting_folder import MeetingFolder, crop_around, new_meeting, write_report
from ja_caregiver.core.numbered_things import Direction
from ja_caregiver.core.schedule import ScheduledLook, load_schedule
from ja_caregiver.request_codec import encode_request
from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.config import Configuration, parameter
from ja_common.core.detection import Detection, caregiver_face
from ja_common.core.geometry import directions_of_rays
from ja_common.core.health import Level
from ja_common.core.posture import STILL_BELOW_RAD_S, Posture
from ja_common.core.request_phase import RequestPhase
from ja_common.core.stamps import NS_PER_S
from ja_common.detection_codec import decode_detections
from ja_common.graph_node import GraphNode
from ja_common.head_description import CAMERA_FRAME
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.reported_save import ReportedSave
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.time_codec import to_time
from ja_common.topics import (
    CAMERA_INFO,
    CAREGIVER_REQUEST,
    CLOCK,
    DETECTIONS,
    FACE_DELTA,
    FIXATION,
    GLANCE_DELTA,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    LM_DELTA,
    TRACK,
    VF_DELTA,
)
from ja_perception.core.frame_sources import SourceError, SourceOptions
from ja_perception.core.open_source import open_source
from ja_sim.core.digital_head import DigitalHead, DigitalHeadConfig

_START_NS = NS_PER_S  # a stamp of zero means 'no time' in ROS
_FASTEST_FILM_HZ = 1000.0
_SHRUNK_ABOVE = 1.5
"""A film whose pixels are finer than the window's by more than this factor is made smaller."""
_PUBLISH_EVERY_S = 0.4
_FACE_MARGIN = 2.0
_PROPOSALS = {
    'learner': LM_DELTA,
    'visual feedback': VF_DELTA,
    'glance': GLANCE_DELTA,
    'face': FACE_DELTA,
}


@dataclass(frozen=True)
class FilmConfig(Configuration):
    """Which film is shown, by which schedule, and at which pace."""

    film: str = parameter('', 'film of a person who follows the schedule')
    schedule: str = parameter('', 'file of the schedule (CSV)')
    offset_s: float = parameter(
        0.0, "time in the film at which the schedule's time zero is, beside its own offset_s",
        low=-86400.0, high=86400.0,
    )  # fmt: skip
    camera_rate_hz: float = parameter(
        10.0, 'images a second of the time of the film', low=1.0, high=100.0
    )
    shown_s: float = parameter(
        3.0, 'so much of the end of each look is shown; as long as the dwell_s of the gate',
        low=0.2, high=60.0,
    )  # fmt: skip
    fixated_within_rad: float = parameter(
        0.1, 'a fixation farther than this from every thing is of none', low=0.01, high=0.5
    )
    seed: int = parameter(0, 'seed of the robot, for the report', low=0)
    learner: str = parameter('', 'name of the learner, for the report')
    folder: str = parameter('', 'folder of the meeting; empty: nothing is saved')
    resend_after_s: float = parameter(
        0.5, 'time after which an image that was not answered is sent again', low=0.05, high=60.0
    )


@dataclass(frozen=True)
class _Round:
    """One image: its messages, view (H, W, 3), posture, things [rad], and what is shown."""

    clock: Clock
    joint_state: JointState
    camera_info: CameraInfo
    image: Image
    view: NDArray[np.uint8]
    posture: Posture
    things: dict[int, Direction]
    trial: int
    phase: SessionPhase
    asked: bool
    thing: int


class FilmSessionNode(GraphNode):
    """Publishes what the digital head sees of the film; the next image waits for the answer.

    The answer is the command, the detections, the proposals and the fixation of the same image.
    They give the score as well, so that neither depends on the scheduling.
    """

    refuses_unknown_parameters = True

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('film_session', **node_kwargs)
        self._config = config = self.configure(FilmConfig)
        session = self.configure(FilmSessionConfig)
        head = self.configure(DigitalHeadConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        schedule = load_schedule(Path(config.schedule).expanduser())
        schedule.check_places(config.schedule)
        self._wide_view_rad = head.wide_view_rad
        self._head = DigitalHead(head)
        self._looks, self._ends_at = schedule.looks, ''
        self._clips = self._open_film(schedule.offset_s + config.offset_s)
        try:
            upcoming = self._read_clips(iter(self._looks))
            self._session = FilmSession(
                partial(next, upcoming, None), config.camera_rate_hz, session
            )
        except ValueError as error:
            self._clips.close()
            # An OSError ends the node with this one sentence.
            raise OSError(f"film '{config.film}': {error}") from None
        self._score = FilmScore(len(self._looks), config.fixated_within_rad)
        self._meeting = new_meeting('film', config.seed, config.learner)
        self._folder: MeetingFolder | None = None
        if config.folder:
            self._folder = MeetingFolder(Path(config.folder).expanduser(), write_report)
            self._save = ReportedSave(self, 'folder', self._folder.save)
        self._pictures: dict[str, str] = {}
        self._face: tuple[NDArray[np.uint8], Detection] | None = None

        decode = self._joints.decode
        proposals = dict.fromkeys((*_PROPOSALS.values(), FIXATION), decode)
        Synchroniser(self).call_with(
            {JOINT_COMMANDS: self._joints.decode_posture, DETECTIONS: decode_detections,
             **proposals},
            self._on_answer,
        )  # fmt: skip
        self.subscribe(TRACK, self._on_track)
        self._simulated_time = self.create_topic_publisher(CLOCK)
        self._joint_states = self.create_topic_publisher(JOINT_STATES)
        self._camera_info = self.create_topic_publisher(CAMERA_INFO)
        self._image = self.create_topic_publisher(IMAGE)
        self._request = self.create_topic_publisher(CAREGIVER_REQUEST)
        self.advertise_service(SetBool, 'caregiver/pause', self._on_pause)
        self.advertise_service(Trigger, 'caregiver/end', self._on_end)
        self.advertise_service(Trigger, 'caregiver/rearranged', self._on_rearranged)

        self._stamp_ns, self._paused = _START_NS, False
        self._round = self._next_round()
        self._published_s = -np.inf
        steady = SteadyClock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(config.resend_after_s / 5, self._resend, clock=steady)
        self.create_timer(_PUBLISH_EVERY_S, self._publish_request, clock=steady)
        self._keep_meeting()

    @property
    def meeting(self) -> Meeting:
        """Return the meeting so far."""
        return self._meeting

    def destroy_node(self) -> None:
        """Save the meeting as it is, release the film, then destroy the node."""
        if self._folder is not None:
            self._folder.leave_out_report()
            self._end_meeting('stopped')
            self._save.close()
        self._clips.close()
        super().destroy_node()

    def _open_film(self, offset_s: float) -> ClipReader:
        options = SourceOptions(loop=False, highest_rate_hz=_FASTEST_FILM_HZ)
        try:
            source = open_source(self._config.film, options, self._warn)
        except SourceError as error:
            raise OSError(str(error)) from None
        self.get_logger().info(source.summary)
        return ClipReader(
            source,
            self._warn,
            rate_hz=self._config.camera_rate_hz,
            shown_s=self._config.shown_s,
            offset_s=offset_s,
            largest_width=self._largest_width,
        )

    def _largest_width(self, width: int) -> int:
        """Return the width [px] at which the wide picture is as fine as the window."""
        same = 2 * self._head.focal_px * np.tan(self._wide_view_rad / 2)
        return round(same) if width > _SHRUNK_ABOVE * same else width

    def _read_clips(self, looks: Iterator[ScheduledLook]) -> Iterator[Clip]:
        """Yield the clips of the looks, as far as the film lasts."""
        for number, look in enumerate(looks, 1):
            clip = self._clips.read_clip(look)
            if clip is None:
                if number > 1:
                    self._ends_at = (
                        f'the film ends at {self._clips.read_s:.1f} s, before look {number} of '
                        f'{len(self._looks)}'
                    )
                    self._warn('film', f'{self._ends_at}: the meeting ends there')
                return
            yield clip

    def _warn(self, where: str, text: str) -> None:
        self.report_problem(where, text, Level.WARN)

    def _on_answer(self, found: StampedSet) -> None:
        if found.stamp_ns != self._stamp_ns or self._paused or self._meeting.ended:
            return  # an answer to an image that was sent twice, or to the last one
        command = found[JOINT_COMMANDS]
        if command is None:
            raise ValueError('a command names no joints')
        shown = self._round
        position = shown.posture.position
        face = caregiver_face(found[DETECTIONS])
        self._session.observe(
            position,
            shown.posture.is_still(STILL_BELOW_RAD_S),
            None if face is None else directions_of_rays(position, face.ray),
        )
        if self._score_image(shown, found, command, face):
            return
        self._head.command(command)
        self._stamp_ns += round(NS_PER_S / self._config.camera_rate_hz)
        self._round = self._next_round()
        self._publish()

    def _score_image(
        self,
        shown: _Round,
        found: StampedSet,
        command: NDArray[np.float64],
        face: Detection | None,
    ) -> bool:
        """Score an image with its answer, keep the trial that it ends; return if all is over."""
        targets = {
            name: shown.posture.position + found[topic]
            for name, topic in _PROPOSALS.items()
            if found[topic] is not None
        }
        if self._session.face is not None:  # the head turns back to where it was
            targets.setdefault('face', self._session.face)
        phase = self._score.phase
        ended = self._score.observe_image(
            FilmImage(
                found.stamp_ns, shown.trial, shown.phase, shown.asked, shown.thing, shown.things,
                targets, command, found[FIXATION],
            )
        )  # fmt: skip
        if ended is not None:
            self._record_trial(ended)
        if face is not None and face.attended:
            self._face = shown.view, face
        if self._score.shift_began and self._face is not None:
            view, seen = self._face
            size = (_FACE_MARGIN * seen.width, _FACE_MARGIN * seen.height)
            self._add_picture('face', shown, crop_around(view, (seen.u, seen.v), size))
        if self._score.fixated:
            self._add_picture('view', shown, shown.view)
        if self._score.phase is RequestPhase.ENDED:
            self._end_meeting(self._ends_at or 'all requests were made')
        if self._score.phase is not phase:
            self._publish_request()
        return bool(self._meeting.ended)

    def _add_picture(self, kind: str, shown: _Round, picture: NDArray[np.uint8]) -> None:
        if self._folder is not None:
            name = f'{shown.trial:03}_{kind}'
            self._pictures[kind] = self._folder.add_picture(name, picture)

    def _record_trial(self, trial: MeetingTrial) -> None:
        trial = replace(
            trial,
            face_picture=self._pictures.get('face', ''),
            view_picture=self._pictures.get('view', ''),
        )
        self._pictures.clear()
        self._meeting = replace(self._meeting, trials=(*self._meeting.trials, trial))
        self._keep_meeting()

    def _keep_meeting(self) -> None:
        if self._folder is not None:
            self._folder.set_meeting(self._meeting)
            self._save.request()

    def _end_meeting(self, why: str) -> None:
        """End the meeting; the first reason stays."""
        if not self._meeting.ended:
            self._meeting = replace(self._meeting, ended=why)
            self._keep_meeting()

    def _next_round(self) -> _Round:
        session = self._session
        wide = session.next_picture()
        view, posture = self._head.render_view(wide, self._stamp_ns)
        stamp = to_time(self._stamp_ns)
        header = Header(stamp=stamp, frame_id=CAMERA_FRAME)
        look, size = session.clip.look, (wide.shape[1], wide.shape[0])
        directions = directions_of_places(look.things, size, self._wide_view_rad).tolist()
        self.health.values['look'] = f'{session.trial} of {len(self._looks)}'
        return _Round(
            Clock(clock=stamp),
            self._joints.encode_posture(header, posture.position, posture.velocity),
            encode_camera_info(header, view.shape[1], view.shape[0], self._head.focal_px),
            encode_image(view, stamp, CAMERA_FRAME),
            view,
            posture,
            {number: (pan, tilt) for number, (pan, tilt) in enumerate(directions, 1)},
            session.trial,
            session.phase,
            session.asked,
            look.thing,
        )

    def _publish(self) -> None:
        self._published_s = time.monotonic()
        self._simulated_time.publish(self._round.clock)
        self._joint_states.publish(self._round.joint_state)
        self._camera_info.publish(self._round.camera_info)
        self._image.publish(self._round.image)

    def _resend(self) -> None:
        """Send the last image again: a message may be lost, and nodes start one by one."""
        if time.monotonic() - self._published_s >= self._config.resend_after_s:
            self._publish()

    def _publish_request(self) -> None:
        report = '' if self._folder is None else self._folder.report
        self._request.publish(
            encode_request(
                self.get_fully_qualified_name(),
                self._score,
                self._meeting,
                self._round.things,
                report,
            )
        )

    def _on_track(self, message: String) -> None:
        self._meeting = replace(self._meeting, track=message.data)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> Any:
        self._paused = request.data
        self._score.pause(request.data)
        self._publish_request()
        response.success = True
        response.message = 'paused' if request.data else 'the film goes on'
        return response

    def _on_end(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._score.phase = RequestPhase.ENDED
        self._end_meeting('ended by the person')
        self._publish_request()
        response.success, response.message = True, 'the meeting has ended'
        return response

    def _on_rearranged(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        raise ValueError('in a film the schedule states when things are moved')


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    spin_node(FilmSessionNode, args)


if __name__ == '__main__':
    main()
