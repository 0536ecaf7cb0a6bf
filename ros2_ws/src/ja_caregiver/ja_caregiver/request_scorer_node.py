"""`request_scorer`: asks a real person to look at things, and scores what the head makes of it.

What she is asked travels on `caregiver/request` alone, to the page that she reads. No node that
learns, moves or sees subscribes to it.
"""

import re
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from ja_caregiver.core.meeting import MEETING_FILE, Meeting, MeetingTrial, load_meeting
from ja_caregiver.core.meeting_folder import (
    MeetingFolder,
    crop_around,
    new_meeting,
    write_report,
)
from ja_caregiver.core.numbered_things import Direction, NumberedThings, NumberedThingsConfig
from ja_caregiver.core.request_draw import RequestDraw
from ja_caregiver.core.requests import GateState, MeetingImage, RequestConfig, RequestCourse
from ja_caregiver.head_hold import HeadHold
from ja_caregiver.request_codec import encode_request
from ja_common.camera_input import CameraInput, CameraInputConfig
from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.detection import Detection, caregiver_face, objects
from ja_common.core.geometry import directions_of_rays
from ja_common.core.health import Level
from ja_common.detection_codec import decode_detections
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.reported_save import ReportedSave
from ja_common.status_values import status_values
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.time_codec import to_ns
from ja_common.topics import (
    CAMERA_INFO,
    CAREGIVER_REQUEST,
    DETECTIONS,
    FIXATION,
    GATE_STATUS,
    IMAGE,
    IMAGE_COMPRESSED,
    LM_DELTA,
    TRACK,
)

_PUBLISH_EVERY_S = 0.4
# A picture is asked for when the detections of its stamp have come.
_IMAGES_KEPT = 30
_FACE_MARGIN = 2.0
_HURRIED_SHIFTS = 3
_COUNT = re.compile('[0-9]{1,12}', re.ASCII)


@dataclass(frozen=True)
class RequestScorerConfig(Configuration):
    """Where the meeting is saved, and what is noted of its origin."""

    seed: int = parameter(0, 'seed of the order of the requests', low=0)
    folder: str = parameter('', 'folder of the meeting; empty: nothing is saved')
    source: str = parameter(
        'topics', 'where the pictures come from', choices=('webcam', 'topics', 'film')
    )
    learner: str = parameter('', 'name of the learner, for the report')
    compressed: bool = parameter(False, 'subscribe to image_raw/compressed instead of image_raw')


class RequestScorerNode(GraphNode):
    """Numbers the things, publishes one request after the other, and saves the trials."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('request_scorer', **node_kwargs)
        config = self.configure(RequestScorerConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        self._meeting = _meeting_so_far(config)
        draw = RequestDraw(config.seed, len(self._meeting.trials))
        self._course = RequestCourse(self.configure(RequestConfig), draw.draw, draw.restart)
        self._course.trials_done = len(self._meeting.trials)
        self._things = NumberedThings(self.configure(NumberedThingsConfig))
        image = IMAGE_COMPRESSED if config.compressed else IMAGE
        self._camera = CameraInput(
            self.configure(CameraInputConfig), self.resolve_topic_name(image.name)
        )
        self._images: OrderedDict[int, Any] = OrderedDict()
        self._face: tuple[Any, Detection] | None = None
        self._hold = HeadHold(self)
        self._folder: MeetingFolder | None = None
        if config.folder:
            self._folder = MeetingFolder(Path(config.folder).expanduser(), write_report)
            self._save = ReportedSave(self, 'folder', self._folder.save)

        Synchroniser(self, self._joints).call_with(
            {
                DETECTIONS: decode_detections,
                LM_DELTA: self._joints.decode,
                FIXATION: self._joints.decode,
            },
            self._observe,
        )
        self.subscribe(GATE_STATUS, self._on_gate_status, expected_every_s=2.0)
        self.subscribe(image, self._on_image)
        self.subscribe(CAMERA_INFO, self._on_camera_info)
        self.subscribe(TRACK, self._on_track)
        self._request = self.create_topic_publisher(CAREGIVER_REQUEST)
        self.advertise_service(SetBool, 'caregiver/pause', self._on_pause)
        self.advertise_service(Trigger, 'caregiver/end', self._on_end)
        self.advertise_service(Trigger, 'caregiver/rearranged', self._on_rearranged)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_PUBLISH_EVERY_S, self._publish, clock=steady)
        self._keep_meeting()
        self._publish()

    @property
    def meeting(self) -> Meeting:
        """Return the meeting so far."""
        return self._meeting

    def destroy_node(self) -> None:
        """Save the meeting as it is, then destroy the node."""
        self._course.end('stopped')
        if self._folder is not None:
            self._folder.leave_out_report()
            self._keep_meeting()
            self._save.close()
        super().destroy_node()

    def _observe(self, found: StampedSet) -> None:
        detections, posture = found[DETECTIONS], found.posture
        rays = np.array([each.ray for each in objects(detections)]).reshape(-1, 2)
        self._things.observe_image(posture, directions_of_rays(posture.position, rays))
        face, delta = caregiver_face(detections), found[LM_DELTA]
        attended = face is not None and face.attended
        if face is not None and attended and found.stamp_ns in self._images:
            self._face = self._images[found.stamp_ns], face
        phase = self._course.phase
        trial = self._course.observe_image(
            MeetingImage(
                found.stamp_ns,
                face_seen=face is not None,
                attended=attended,
                things=self._things.directions,
                proposal=None if delta is None else _pair(posture.position + delta),
                fixation=_pair(found[FIXATION]),
            )
        )
        if trial is not None:
            self._record_trial(trial, found.stamp_ns)
        if self._course.phase is not phase:
            self._on_phase()

    def _record_trial(self, trial: MeetingTrial, stamp_ns: int) -> None:
        """Keep a trial with its pictures: her face at the look, the view at its end."""
        if self._folder is not None:
            name = f'{trial.trial:03}'
            trial = replace(
                trial,
                face_picture=self._queue_picture(f'{name}_face', self._face_picture),
                view_picture=self._queue_picture(f'{name}_view', self._picture(stamp_ns)),
            )
        self._meeting = replace(self._meeting, trials=(*self._meeting.trials, trial))
        self._keep_meeting()

    def _queue_picture(self, name: str, picture: NDArray[np.uint8] | None) -> str:
        """Queue a picture for the folder; return its file name, '' without one."""
        if picture is None or self._folder is None:
            return ''
        return self._folder.add_picture(name, picture)

    @property
    def _face_picture(self) -> NDArray[np.uint8] | None:
        """Return her face, (h, w, 3), in the last image in which the head rested on it."""
        if self._face is None:
            return None
        message, face = self._face
        picture = self._decode(message)
        size = (_FACE_MARGIN * face.width, _FACE_MARGIN * face.height)
        return None if picture is None else crop_around(picture, (face.u, face.v), size)

    def _picture(self, stamp_ns: int) -> NDArray[np.uint8] | None:
        """Return the upright picture (H, W, 3) of a stamp, if it came and can be decoded."""
        message = self._images.get(stamp_ns)
        return None if message is None else self._decode(message)

    def _decode(self, message: Any) -> NDArray[np.uint8] | None:
        try:
            return self._camera.decode(message)
        except ValueError as error:
            self.report_problem('picture', f'a picture for the report: {error}', Level.WARN)
            return None

    def _keep_meeting(self) -> None:
        self._meeting = replace(self._meeting, ended=self._course.ended)
        if self._folder is not None:
            self._folder.set_meeting(self._meeting)
            self._save.request()

    def _on_phase(self) -> None:
        """Publish a new phase at once."""
        if self._course.ended != self._meeting.ended:
            self._keep_meeting()
        self._publish()

    def _on_gate_status(self, message: DiagnosticStatus) -> None:
        values = status_values(message)
        state = _gate_state(values)
        phase = self._course.phase
        self._course.observe_gate(state)
        if self._course.phase is not phase:
            self._on_phase()
        if self._course.hurried >= _HURRIED_SHIFTS:
            self.report_problem(
                'pace',
                'the head shifts before she could have turned: raise dwell_s of the gate, or '
                'lower camera_s',
                Level.WARN,
            )
        self._hold.update(self._course.holds_head, values.get('enabled') == 'True')

    def _on_image(self, message: Any) -> None:
        self._images[to_ns(message.header.stamp)] = message
        while len(self._images) > _IMAGES_KEPT:
            self._images.popitem(last=False)

    def _on_camera_info(self, message: CameraInfo) -> None:
        self._camera.record_camera_info(message)
        camera = self._camera.full_view()
        if camera is not None:
            self._things.half_view_rad = camera.half_view_rad

    def _on_track(self, message: String) -> None:
        self._meeting = replace(self._meeting, track=message.data)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> Any:
        self._course.pause(request.data)
        return self._answered(response, 'paused' if request.data else 'the meeting goes on')

    def _on_end(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._course.end('ended by the person')
        return self._answered(response, 'the meeting has ended')

    def _on_rearranged(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._things.restart()
        self._course.rearranged()
        return self._answered(response, 'the things get new numbers')

    def _answered(self, response: Any, text: str) -> Any:
        response.success, response.message = True, text
        self._on_phase()
        return response

    def _publish(self) -> None:
        report = '' if self._folder is None else self._folder.report
        self._request.publish(
            encode_request(
                self.get_fully_qualified_name(),
                self._course,
                self._meeting,
                self._things.directions,
                report,
            )
        )


def _meeting_so_far(config: RequestScorerConfig) -> Meeting:
    """Return a new meeting, or that of the folder: this node was started again meanwhile."""
    path = Path(config.folder).expanduser() / MEETING_FILE
    if config.folder and path.exists():
        try:
            return replace(load_meeting(path), ended='')
        except ValueError as error:
            raise ConfigError(f'folder: {error}') from None
    return new_meeting(config.source, config.seed, config.learner)


def _gate_state(values: Mapping[str, str]) -> GateState:
    """Return what the gate states. Raises ValueError where its phase or trials are missing."""
    phase, trials = values.get('phase', ''), values.get('trials', '')
    if not phase or not _COUNT.fullmatch(trials):
        raise ValueError(f'no phase and number of trials of a gate: {dict(values)}')
    return GateState(phase, int(trials), values.get('source', ''))


def _pair(direction: NDArray[np.float64] | None) -> Direction | None:
    return None if direction is None else (float(direction[0]), float(direction[1]))


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    spin_node(RequestScorerNode, args)


if __name__ == '__main__':
    main()
