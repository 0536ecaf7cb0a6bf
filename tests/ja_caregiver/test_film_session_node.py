"""The player of a film as a node: lockstep, trials, services, and films that cannot be used."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from ja_caregiver.core.meeting import load_meeting
from ja_caregiver.core.schedule import Schedule, ScheduledLook, save_schedule
from ja_caregiver.film_session_node import FilmSessionNode
from ja_common.core.config import ConfigError
from ja_common.core.detection import Detection, Kind
from ja_common.detection_codec import encode_detections
from ja_common.image_codec import decode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.status_values import status_values
from ja_common.time_codec import to_ns
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
    VF_DELTA,
)

ANSWERS = [JOINT_COMMANDS, DETECTIONS, LM_DELTA, VF_DELTA, GLANCE_DELTA, FACE_DELTA, FIXATION]
THINGS = ((0.3, 0.5), (0.7, 0.5))
LOOKS = (ScheduledLook(0.5, 0.8, 1.2, 1, THINGS), ScheduledLook(1.2, 1.5, 1.9, 2, THINGS))
JOINTS = JointCodec(JointConfig())


def write_film(path: Path, seconds: float = 3.0, size: tuple[int, int] = (160, 90)) -> None:
    """Write a film whose pictures become brighter."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*'MJPG'), 10.0, size)
    for number in range(round(10 * seconds)):
        writer.write(np.full((size[1], size[0], 3), 8 * number, np.uint8))
    writer.release()


@pytest.fixture
def files(tmp_path: Path) -> dict:
    """Write a film and its schedule; return the parameters of the node."""
    write_film(tmp_path / 'film.avi')
    save_schedule(Schedule(LOOKS), tmp_path / 'plan.csv')
    return {
        'film': str(tmp_path / 'film.avi'),
        'schedule': str(tmp_path / 'plan.csv'),
        'shown_s': 0.5,
        'time_constant_s': 0.001,
    }


@pytest.fixture
def make_robot(make_bench, files):
    def make(**parameters):
        topics = [IMAGE, CAMERA_INFO, JOINT_STATES, CLOCK, CAREGIVER_REQUEST]
        bench = make_bench(FilmSessionNode, ANSWERS, topics, **{**files, **parameters})
        return Robot(bench)

    return make


class Robot:
    """Answers each image as the nodes of the robot do: her face stands straight ahead."""

    def __init__(self, bench) -> None:
        self.bench = bench
        self.head = np.zeros(2)

    def see(self) -> tuple[int, np.ndarray]:
        """Return stamp [ns] and picture of the newest image."""
        image = self.bench.messages(IMAGE)[-1]
        return to_ns(image.header.stamp), decode_image(image)

    def answer(self, to=(0.0, 0.0), fixation=None) -> None:
        """Answer the newest image, and wait for the next one."""
        images = self.bench.messages(IMAGE)
        self.bench.wait(lambda: images)
        stamp = images[-1].header.stamp
        header = Header(stamp=stamp)
        to, here = np.asarray(to), self.head
        face = -here / [1.0, -1.0]
        seen = [Detection(Kind.FACE, face[0], face[1], 160, 120, 40, 40, 1.0, attended=True)]
        if np.abs(here).max() > 0.1:
            seen = []
        deltas = {
            LM_DELTA: to - here if np.any(to) else None,
            VF_DELTA: None,
            GLANCE_DELTA: None,
            FACE_DELTA: -here if seen else None,
            FIXATION: fixation,
        }
        for topic, delta in deltas.items():
            self.bench.publish(topic, JOINTS.encode(header, delta))
        self.bench.publish(DETECTIONS, encode_detections(header, seen))
        self.bench.publish(JOINT_COMMANDS, JOINTS.encode_posture(header, to))
        self.head = to

    def step(self, to=(0.0, 0.0), fixation=None) -> int:
        """Answer, and return the stamp of the next image [ns]."""
        self.bench.wait(lambda: self.bench.messages(IMAGE))
        before, _ = self.see()
        self.answer(to, fixation)
        self.bench.wait(lambda: self.see()[0] > before)
        return self.see()[0]

    def trial(self, thing: int) -> None:
        """Look at her to the end of the look, shift to a thing, fixate it, and look back."""
        for _ in range(7):
            self.step()
        at = self.bench.node._round.things[thing]
        self.step(at)
        self.step(at, fixation=at)
        self.step()


def shows(bench, **wanted: str) -> bool:
    """Return whether the newest request has these values."""
    messages: list[DiagnosticStatus] = bench.messages(CAREGIVER_REQUEST)
    return bool(messages) and wanted.items() <= dict(status_values(messages[-1])).items()


def test_an_image_waits_for_its_answer_and_is_sent_again(make_robot):
    robot = make_robot(resend_after_s=0.05)
    bench = robot.bench
    bench.wait(lambda: len(bench.messages(IMAGE)) >= 3)
    assert len({to_ns(each.header.stamp) for each in bench.messages(IMAGE)}) == 1
    first = robot.see()[0]
    assert robot.step() == first + 10**8
    bench.wait(lambda: bench.messages(CLOCK)[-1].clock == bench.messages(IMAGE)[-1].header.stamp)
    assert bench.messages(CAMERA_INFO)[-1].width == 320


def test_the_head_follows_the_command_and_reports_its_posture_at_the_stamp(make_robot):
    robot = make_robot()
    stamp_ns = robot.step((0.1, 0.05))
    states = robot.bench.messages(JOINT_STATES)
    robot.bench.wait(lambda: to_ns(states[-1].header.stamp) == stamp_ns)
    assert JOINTS.decode_posture(states[-1]) == pytest.approx([0.1, 0.05], abs=1e-6)


def test_the_film_goes_on_while_the_head_looks_at_her_alone(make_robot):
    robot = make_robot()
    levels = []
    for _ in range(6):
        robot.step()
        levels.append(int(robot.see()[1][120, 160, 0]))
    assert levels == sorted(levels)
    assert levels[-1] > levels[0]
    held = set()
    for _ in range(8):
        robot.step((0.3, 0.0))
        held.add(robot.bench.node._session.clip.look.thing)
    assert held == {1}


def test_trials_are_scored_saved_and_shown_and_the_meeting_ends(make_robot, tmp_path):
    folder = tmp_path / 'meeting'
    robot = make_robot(folder=str(folder), learner='gaze_line', seed=4)
    node, bench = robot.bench.node, robot.bench
    robot.trial(1)
    robot.step()
    robot.step()
    bench.wait(lambda: shows(bench, trial='2'))
    robot.trial(1)
    robot.step()
    robot.answer()
    bench.wait(lambda: node.meeting.ended)
    bench.wait(lambda: shows(bench, phase='ended'))
    assert shows(bench, film='true')
    assert [each.success for each in node.meeting.trials] == [True, False]
    assert node.meeting.ended == 'all requests were made'
    bench.close()
    bench.close = lambda: None
    saved = load_meeting(folder / 'meeting.json')
    assert saved == node.meeting
    assert (saved.source, saved.learner, saved.seed) == ('film', 'gaze_line', 4)
    for trial in saved.trials:
        assert (folder / trial.face_picture).exists()
        assert (folder / trial.view_picture).exists()


def test_a_paused_film_stands_still(make_robot):
    robot = make_robot(resend_after_s=0.05)
    bench = robot.bench
    robot.step()
    before, _ = robot.see()
    assert bench.call(SetBool, 'caregiver/pause', data=True).success
    robot.answer()
    bench.wait(lambda: shows(bench, phase='paused'))
    robot.answer()
    assert robot.see()[0] == before
    assert bench.call(SetBool, 'caregiver/pause', data=False).success
    assert robot.step() == before + 10**8


def test_the_person_may_end_it_but_not_move_things(make_robot):
    bench = make_robot().bench
    refused = bench.call(Trigger, 'caregiver/rearranged')
    assert not refused.success
    assert 'the schedule states when things are moved' in refused.message
    assert bench.call(Trigger, 'caregiver/end').success
    assert bench.node.meeting.ended == 'ended by the person'


def test_a_film_that_is_too_short_ends_the_meeting_early(make_robot, files, tmp_path):
    write_film(tmp_path / 'film.avi', 1.5)
    robot = make_robot()
    robot.trial(1)
    robot.step()
    robot.answer()
    robot.bench.wait(lambda: robot.bench.node.meeting.ended)
    assert robot.bench.node.meeting.ended.startswith('the film ends at 1.5 s, before look 2 of 2')
    assert 'the meeting ends there' in robot.bench.complaint()


def no_film(folder: Path) -> dict:
    return {'film': str(folder / 'other.avi')}


def broken_film(folder: Path) -> dict:
    (folder / 'film.avi').write_bytes((folder / 'film.avi').read_bytes()[:300])
    return {}


def shorter_than_a_look(folder: Path) -> dict:
    write_film(folder / 'film.avi', 0.8)
    return {}


@pytest.mark.parametrize('spoil', [no_film, broken_film, shorter_than_a_look])
def test_a_film_that_cannot_be_used_ends_the_node_with_one_sentence(
    make_robot, tmp_path, files, spoil
):
    changes = spoil(tmp_path)
    with pytest.raises(OSError, match=r'\.avi') as caught:
        make_robot(**changes)
    assert '\n' not in str(caught.value)


def test_a_schedule_without_places_or_with_a_mistake_is_refused(make_robot, files, tmp_path):
    (tmp_path / 'plan.csv').write_text('kind,camera_s,start_s,end_s,thing\nlook,1,2,3,1\n')
    with pytest.raises(ConfigError, match='by its number only'):
        make_robot()
    (tmp_path / 'plan.csv').write_text('kind,camera_s,start_s,end_s,thing\nlook,1,2,two,1\n')
    with pytest.raises(ConfigError, match=r'plan\.csv:2'):
        make_robot()
