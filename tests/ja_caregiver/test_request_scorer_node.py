"""`request_scorer`: a whole meeting over real topics, with what a robot and a person do."""

import json
import random
import threading

import cv2
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header, String
from std_srvs.srv import SetBool, Trigger

from ja_caregiver.core.meeting import load_meeting
from ja_caregiver.request_scorer_node import RequestScorerNode
from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.config import ConfigError
from ja_common.core.detection import Detection, Kind
from ja_common.core.geometry import rays_of_directions
from ja_common.detection_codec import encode_detections
from ja_common.image_codec import encode_image
from ja_common.time_codec import to_time
from ja_common.topics import (
    CAMERA_INFO,
    CAREGIVER_REQUEST,
    DETECTIONS,
    FIXATION,
    GATE_STATUS,
    IMAGE,
    JOINT_STATES,
    LM_DELTA,
    TRACK,
)
from node_bench import header, joint_state
from odd_messages import extreme, foreign, garbled, malformed

PUBLISHED = [
    DETECTIONS, JOINT_STATES, LM_DELTA, FIXATION, GATE_STATUS, IMAGE, CAMERA_INFO, TRACK
]  # fmt: skip
THINGS = {1: (0.2, 0.1), 2: (0.05, 0.15), 3: (-0.2, 0.1)}
FACE = (0.0, -0.05)
PERIOD_NS = 10**8
WIDTH, HEIGHT, FOCAL = 160, 120, 246.0


class Robot:
    """What the nodes of a robot publish, image after image, before a person with three things."""

    def __init__(self, bench):
        self.bench = bench
        self.stamp_ns, self.trials, self.things = 10**9, 0, dict(THINGS)
        self.person, self.passer, self.enabled = True, False, True
        self.enabled_calls = []
        bench.peer.create_service(SetBool, 'gate/enable', self._on_enable)
        bench.publish(TRACK, String(data='strict'))
        bench.publish(CAMERA_INFO, encode_camera_info(header(1), WIDTH, HEIGHT, FOCAL))
        bench.wait(lambda: bench.received(TRACK) and bench.received(CAMERA_INFO))
        bench.wait(lambda: bench.messages(CAREGIVER_REQUEST))

    def _on_enable(self, request, response):
        self.enabled = request.data
        self.enabled_calls.append(request.data)
        response.success = True
        return response

    def image(self, gate='look', at=FACE, count=1, proposal=None, fixation=None, source=''):
        """Publish all messages of some images with the head at rest; return the request."""
        for _ in range(count):
            self.stamp_ns += PERIOD_NS
            head = header(self.stamp_ns)
            delta = None if proposal is None else np.subtract(proposal, at)
            # Not kept in step with the set below: images are best effort.
            pixels = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
            self.bench.publish(IMAGE, encode_image(pixels, head.stamp, 'eye'))
            wanted = self.bench.received(IMAGE) + 1
            self.bench.wait(lambda wanted=wanted: self.bench.received(IMAGE) >= wanted)
            self.bench.publish_posture(self.stamp_ns, *at)
            self.bench.publish(DETECTIONS, encode_detections(head, self._detections(at)))
            self.bench.publish(
                LM_DELTA, joint_state(self.stamp_ns, *(delta if delta is not None else ()))
            )
            self.bench.publish(FIXATION, joint_state(self.stamp_ns, *(fixation or ())))
            self.bench.wait(self._is_taken)
            self.status(gate, source)
        return self.request()

    def _is_taken(self):
        counts = {self.bench.received(t) for t in (JOINT_STATES, DETECTIONS, LM_DELTA, FIXATION)}
        return len(counts) == 1

    def status(self, phase, source=''):
        values = {'phase': phase, 'trials': str(self.trials), 'enabled': str(self.enabled)}
        if source:
            values['source'] = source
        before = self.bench.received(GATE_STATUS)
        pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
        self.bench.publish(GATE_STATUS, DiagnosticStatus(name='/gate', values=pairs))
        self.bench.wait(lambda: self.bench.received(GATE_STATUS) > before)

    def _detections(self, at):
        rays = {place: rays_of_directions(at, place) for place in self.things.values()}
        inside = {p: r for p, r in rays.items() if np.abs(r[0]) < 0.32 and np.abs(r[1]) < 0.24}
        rows = []
        face = rays_of_directions(at, FACE)
        if self.person and np.abs(face).max() < 0.3:
            attended = bool(np.hypot(*face) < 0.05)
            rows.append(detection(Kind.FACE, face, attended=attended))
        if self.passer:
            rows.append(detection(Kind.FACE, (0.25, -0.1)))
        return rows + [detection(Kind.OBJECT, ray) for ray in inside.values()]

    def request(self):
        """Return the newest request: its values, and `message` and `level`."""
        message = self.bench.messages(CAREGIVER_REQUEST)[-1]
        values = {pair.key: pair.value for pair in message.values}
        return values | {'message': message.message, 'level': message.level}

    def wait_for(self, **values):
        """Wait until the request has these values."""
        self.bench.wait(lambda: self.request().items() >= values.items())
        return self.request()

    def to_request(self):
        """Look at her until she is asked for a thing; return its number."""
        for _ in range(60):
            self.image()
            if self.bench.node._course.phase.value == 'thing':
                return int(self.wait_for(phase='thing')['number'])
        raise AssertionError(self.request())

    def place(self, number):
        """Return where a thing with a number of the scorer's is."""
        rows = [row.split() for row in self.request()['things'].split(';')]
        things = {int(number): (float(pan), float(tilt)) for number, pan, tilt in rows}
        return things[number]

    def trial(self, fixated=None, proposed=None, source='LM'):
        """Let the robot answer the request."""
        proposal = None if proposed is None else self.place(proposed)
        self.image(count=12, proposal=proposal)
        target = (0.3, 0.0) if fixated is None else self.place(fixated)
        self.image('shift', target, proposal=proposal, source=source)
        self.trials += 1
        self.image('look', target, fixation=None if fixated is None else target)
        self.image(count=6 if fixated is None else 1)


def detection(kind, ray, **more):
    u, v = FOCAL * ray[0] + WIDTH / 2, FOCAL * ray[1] + HEIGHT / 2
    return Detection(kind, float(ray[0]), float(ray[1]), u, v, 30.0, 30.0, 0.9, **more)


@pytest.fixture
def make_robot(make_bench):
    def make(**parameters):
        given = {'rearrange_every': 0, **parameters}
        return Robot(make_bench(RequestScorerNode, PUBLISHED, [CAREGIVER_REQUEST], **given))

    return make


def test_a_meeting_from_the_first_thing_to_the_end(make_robot, tmp_path):
    folder = tmp_path / 'meet'
    robot = make_robot(trials=3, folder=str(folder), source='webcam', learner='gaze_line')
    assert robot.wait_for(phase='starting')['things'] == ''
    first = robot.image(count=12)
    assert (first['phase'], first['message']) == ('camera', 'Look at the camera.')
    for number, place in THINGS.items():
        assert robot.place(number) == pytest.approx(place, abs=0.01)

    asked = robot.to_request()
    assert robot.request()['message'] == f'Look at thing {asked}.'
    assert (robot.request()['trial'], robot.request()['trials']) == ('1', '3')
    robot.trial(fixated=asked, proposed=asked)
    found = robot.wait_for(phase='answer', answer=str(asked), right='true')
    assert (found['learner_successes'], found['learner_trials']) == ('1', '1')
    assert found['chance'] == '0.3333'

    asked = robot.to_request()
    other = asked % 3 + 1
    robot.trial(fixated=other, proposed=asked, source='VF')
    found = robot.wait_for(phase='answer', answer=str(other), right='false')
    assert (found['learner_successes'], found['successes']) == ('2', '1')

    asked = robot.to_request()
    robot.trial(fixated=None, proposed=None)
    robot.wait_for(phase='answer', answer='', right='false')
    robot.image(count=12)
    ended = robot.wait_for(phase='ended')
    low, high = map(float, ended['learner_interval'].split())
    assert low < 1.0 == high

    path = folder / 'meeting.json'
    robot.bench.wait((folder / 'pictures' / '003_view.jpg').exists)
    robot.bench.wait(lambda: load_meeting(path).ended)
    meeting = load_meeting(path)
    assert (meeting.source, meeting.learner, meeting.track) == ('webcam', 'gaze_line', 'strict')
    assert meeting.ended == 'all requests were made'
    assert [t.success for t in meeting.trials] == [True, False, False]
    assert [t.learner_right for t in meeting.trials] == [True, True, None]
    assert [t.followed_learner for t in meeting.trials] == [True, False, True]
    for trial in meeting.trials:
        assert cv2.imread(str(folder / trial.view_picture)).shape == (HEIGHT, WIDTH, 3)
        assert cv2.imread(str(folder / trial.face_picture)).shape == (60, 60, 3)
    robot.bench.wait(lambda: robot.status('look') or robot.enabled_calls == [False])


def test_a_passer_is_no_caregiver(make_robot):
    robot = make_robot()
    robot.image(count=12)
    asked = robot.to_request()
    robot.passer = True
    robot.trial(fixated=asked)
    assert robot.wait_for(phase='answer')['right'] == 'true'


def test_without_a_person_the_requests_wait(make_robot):
    robot = make_robot()
    asked = robot.to_request()
    robot.person = False
    robot.image(count=15)
    robot.image('search', count=10)
    found = robot.wait_for(phase='no_person', message='I see no person.')
    assert found['level'] == bytes([1])
    robot.person = True
    assert robot.to_request() == asked
    assert robot.request()['level'] == bytes([0])


def test_pause_holds_the_head_by_the_gate_and_lets_it_go(make_robot):
    robot = make_robot()
    asked = robot.to_request()
    assert robot.bench.call(SetBool, 'caregiver/pause', data=True).success
    found = robot.wait_for(phase='paused')
    assert found['level'] == bytes([1])
    robot.bench.wait(lambda: robot.status('look') or not robot.enabled)
    robot.image(count=5)
    robot.bench.call(SetBool, 'caregiver/pause', data=False)
    robot.bench.wait(lambda: robot.status('look') or robot.enabled)
    assert robot.enabled_calls == [False, True]
    assert robot.to_request() == asked


def test_a_head_that_was_disabled_by_others_stays_so(make_robot):
    robot = make_robot()
    robot.enabled = False
    robot.image(count=3)
    robot.bench.call(SetBool, 'caregiver/pause', data=True)
    robot.image(count=3)
    robot.bench.call(SetBool, 'caregiver/pause', data=False)
    robot.image(count=3)
    assert robot.enabled_calls == []


def test_rearranging_starts_with_new_numbers(make_robot):
    robot = make_robot(rearrange_every=1)
    robot.trial(fixated=robot.to_request())
    robot.image(count=12)
    robot.wait_for(phase='rearrange', message='Move the things to other places.')
    robot.bench.wait(lambda: robot.status('look') or not robot.enabled)
    robot.things = {1: (0.15, 0.12), 2: (-0.15, 0.12)}
    robot.image(count=3)
    assert robot.bench.call(Trigger, 'caregiver/rearranged').success
    assert robot.wait_for(phase='starting')['things'] == ''
    robot.bench.wait(lambda: robot.status('look') or robot.enabled)
    robot.to_request()
    assert robot.place(1) == pytest.approx((0.15, 0.12), abs=0.01)
    assert robot.place(2) == pytest.approx((-0.15, 0.12), abs=0.01)


def test_a_fixation_of_something_without_a_number_is_no_thing(make_robot):
    robot = make_robot()
    robot.to_request()
    robot.image(count=12)
    robot.image('shift', (0.6, 0.3))
    robot.trials += 1
    robot.image('look', (0.6, 0.3), fixation=(0.6, 0.3))
    robot.wait_for(phase='answer', answer='', right='false', message='I found no thing.')


def test_the_person_may_end_it(make_robot, tmp_path):
    robot = make_robot(folder=str(tmp_path))
    robot.trial(fixated=robot.to_request())
    assert robot.bench.call(Trigger, 'caregiver/end').success
    robot.wait_for(phase='ended', message='The meeting has ended.')
    path = tmp_path / 'meeting.json'
    robot.bench.wait(lambda: path.exists() and load_meeting(path).ended)
    assert load_meeting(path).ended == 'ended by the person'


def test_a_stopped_node_saves_and_one_that_is_started_again_goes_on(make_robot, tmp_path):
    robot = make_robot(folder=str(tmp_path))
    robot.trial(fixated=robot.to_request())
    robot.bench.close()
    before = load_meeting(tmp_path / 'meeting.json')
    assert (before.ended, len(before.trials)) == ('stopped', 1)
    robot = make_robot(folder=str(tmp_path), trials=2)
    robot.trial(fixated=robot.to_request())
    robot.image(count=12)
    robot.wait_for(phase='ended', trial='2')
    robot.bench.wait(lambda: len(load_meeting(tmp_path / 'meeting.json').trials) == 2)
    assert load_meeting(tmp_path / 'meeting.json').trials[0] == before.trials[0]


def test_a_full_disk_stops_nothing(make_robot, tmp_path):
    place = tmp_path / 'meet'
    place.write_text('a file in the place of the folder')
    robot = make_robot(folder=str(place / 'inside'))
    robot.trial(fixated=robot.to_request())
    robot.wait_for(phase='answer')
    robot.bench.wait_for_complaint('not saved')
    robot.trial(fixated=robot.to_request())
    place.unlink()
    path = place / 'inside' / 'meeting.json'
    robot.bench.wait(lambda: path.exists() and len(load_meeting(path).trials) == 2)


def test_a_damaged_meeting_is_refused(make_robot, tmp_path):
    (tmp_path / 'meeting.json').write_text(json.dumps({'format': 1}))
    with pytest.raises(ConfigError, match='damaged meeting file'):
        make_robot(folder=str(tmp_path))


def test_a_gate_that_is_too_quick_is_a_problem(make_robot):
    robot = make_robot()
    for _ in range(3):
        robot.to_request()
        robot.image(count=2)
        robot.image('shift', (0.3, 0.0))
        robot.trials += 1
    robot.bench.wait_for_complaint('raise dwell_s of the gate')


def test_it_outlives_odd_messages(make_robot):
    robot = make_robot()
    asked = robot.to_request()
    bench, rng = robot.bench, random.Random(4)
    for index in range(20):
        for topic in PUBLISHED:
            head = Header(stamp=to_time(robot.stamp_ns + index), frame_id='eye')
            odd = malformed(topic.type, rng)
            messages = [odd, extreme(topic.type, head, rng), *foreign(topic.type, head)]
            for message in messages:
                bench.publish(topic, message)
            try:
                bench.publish(topic, deserialize_message(garbled(odd, rng), topic.type))
            except Exception:  # it cannot be read by any node
                continue
        for _ in range(60):
            bench.executor.spin_once(timeout_sec=0.0)
    bench.call(Trigger, 'caregiver/rearranged')
    robot.stamp_ns += 10**12
    bench.publish(CAMERA_INFO, encode_camera_info(header(1), WIDTH, HEIGHT, FOCAL))
    assert asked
    for _ in range(100):
        bench.executor.spin_once(timeout_sec=0.0)
    for _ in range(200):
        robot.stamp_ns += PERIOD_NS
        bench.publish_posture(robot.stamp_ns, *FACE)
        head = header(robot.stamp_ns)
        bench.publish(DETECTIONS, encode_detections(head, robot._detections(FACE)))
        bench.publish(LM_DELTA, joint_state(robot.stamp_ns))
        bench.publish(FIXATION, joint_state(robot.stamp_ns))
        robot.status('look')
        if bench.node._course.phase.value == 'thing':
            break
    assert bench.node._course.phase.value == 'thing'


def test_no_thread_is_left(make_robot, tmp_path):
    before = threading.active_count()
    robot = make_robot(folder=str(tmp_path))
    robot.bench.close()
    assert threading.active_count() <= before
