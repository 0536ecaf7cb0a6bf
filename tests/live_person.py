"""A simulated person before a digital head who does what the page asks, in lockstep.

She reads the request as a person reads the page: the robot's nodes never see it.
"""

import time
from dataclasses import replace
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.clock import Clock as SteadyClock
from rclpy.clock import ClockType
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.geometry import angle_between
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.status_values import status_values
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    CAMERA_INFO,
    CAREGIVER_REQUEST,
    CLOCK,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
)
from ja_sim.core.behaviour import ROBOT, CaregiverBehaviour
from ja_sim.core.digital_head import DigitalHead
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld

RATE_HZ = 10.0
HEARS_S = 0.4
"""Until she has read the request and begins to turn, in the time of the pictures."""
_SIZE = (568, 426)
_VIEW_DEG = 60.0
_RESEND_AFTER_S = 1.0


class _DoesWhatIsAsked(CaregiverBehaviour):
    """She looks at `wanted`, whatever the robot does."""

    wanted = ROBOT

    def update(self, now_s: float, offset_rad: float, speed_rad_s: float, objects: int) -> bool:
        if self.wanted not in (ROBOT, self.response.attended):
            response = self._choose_response(objects)
            self.response = replace(response, attended=self.wanted, reliable=True)
        return False

    def attends_to(self, now_s: float) -> int:
        return self.wanted


class _World(JointAttentionWorld):
    """A world whose caregiver looks where she is asked to."""

    def reset(self, seed: int | None = None) -> None:
        super().reset(seed)
        rng = np.random.default_rng([self._seed, 1])
        self.behaviour = self._behaviour = _DoesWhatIsAsked(self.scene.caregiver, rng)


class LivePersonNode(GraphNode):
    """Publishes what a digital head sees of her; the next image waits for the command."""

    def __init__(self, things: int = 4, seed: int = 1000, **node_kwargs: Any) -> None:
        super().__init__('live_person', **node_kwargs)
        self._joints = JointCodec(self.configure(JointConfig))
        self._head = DigitalHead()
        self.world = _World(_scene(things), seed, _SIZE)
        self.asked: list[tuple[int, int]] = []
        """Of each request: the number, and the index of the object that she then looks at."""
        self._request: dict[str, str] = {}
        self._due: tuple[int, int] | None = None
        self._stamp_ns = NS_PER_S
        self._published_s = 0.0
        topics = (CLOCK, JOINT_STATES, CAMERA_INFO, IMAGE)
        self._talkers = {topic: self.create_topic_publisher(topic) for topic in topics}
        self._rearranged = self.create_client(Trigger, 'caregiver/rearranged')
        self.subscribe(CAREGIVER_REQUEST, self._on_request)
        self.subscribe(JOINT_COMMANDS, self._on_command)
        self._draw()
        steady = SteadyClock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_RESEND_AFTER_S, self._resend, clock=steady)

    def destroy_node(self) -> None:
        self.world.close()
        super().destroy_node()

    def _on_request(self, message: DiagnosticStatus) -> None:
        before, self._request = self._request, status_values(message)
        phase, number = self._request['phase'], self._request['number']
        if (phase, number) == (before.get('phase'), before.get('number')):
            return
        if phase == 'thing':
            rows = [row.split() for row in self._request['things'].split(';')]
            [place] = [np.array(row[1:], float) for row in rows if row[0] == number]
            index = int(np.argmin(angle_between(self.world.truth().directions, place)))
            self.asked.append((int(number), index))
            self._due = self._stamp_ns + int(HEARS_S * NS_PER_S), index
        elif phase in ('camera', 'rearrange'):
            self._due = self._stamp_ns, ROBOT
        if phase == 'rearrange':
            self.world.rearrange()
            self._rearranged.call_async(Trigger.Request())

    def _on_command(self, message: JointState) -> None:
        if to_ns(message.header.stamp) != self._stamp_ns:
            return
        self._head.command(self._joints.decode_command(message, self._head.target))
        self._stamp_ns += round(NS_PER_S / RATE_HZ)
        self._draw()
        self._publish()

    def _draw(self) -> None:
        if self._due is not None and self._stamp_ns >= self._due[0]:
            self.world.behaviour.wanted, self._due = self._due[1], None
        self.world.step(1 / RATE_HZ)
        wide = np.asarray(self.world.observe().image, np.uint8)
        view, posture = self._head.render_view(wide, self._stamp_ns)
        stamp = to_time(self._stamp_ns)
        header = Header(stamp=stamp, frame_id='eye')
        height, width = view.shape[:2]
        self._messages = {
            CLOCK: Clock(clock=stamp),
            JOINT_STATES: self._joints.encode_posture(header, posture.position, posture.velocity),
            CAMERA_INFO: encode_camera_info(header, width, height, self._head.focal_px),
            IMAGE: encode_image(view, stamp, 'eye'),
        }

    def _publish(self) -> None:
        self._published_s = time.monotonic()
        for topic, message in self._messages.items():
            self._talkers[topic].publish(message)

    def _resend(self) -> None:
        """Send the image again that was not answered: nodes start one by one."""
        if time.monotonic() - self._published_s >= _RESEND_AFTER_S:
            self._publish()


def _scene(things: int):
    """Return the default scene as a wide camera sees it, with all things in its picture."""
    scene = load_scene('default')
    half_tilt = float(
        np.degrees(np.arctan(np.tan(np.radians(_VIEW_DEG / 2)) * _SIZE[1] / _SIZE[0]))
    )
    head = replace(
        scene.head, view_pan_deg=_VIEW_DEG / 2, view_tilt_deg=half_tilt, camera_rate_hz=0.0,
        camera_latency_s=0.0,
    )  # fmt: skip
    reach = 0.75 * _VIEW_DEG / 2
    objects = replace(
        scene.objects, count=things, rearranged='replaced', pan_deg=(-reach, reach),
        tilt_deg=(-14.0, 14.0),
    )  # fmt: skip
    return replace(scene, head=head, objects=objects)
