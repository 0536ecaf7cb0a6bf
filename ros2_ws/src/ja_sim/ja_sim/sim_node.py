"""`sim`: the simulated world as a camera and a pan-tilt head on ROS topics."""

import math
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rclpy.timer import Timer
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2
from std_msgs.msg import Header, String
from std_srvs.srv import SetBool, Trigger

from ja_common.camera_info_codec import encode_camera_info
from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.health import Level
from ja_common.core.stamps import NS_PER_S
from ja_common.depth_encoder import DEPTH_ENCODINGS, encode_depth
from ja_common.graph_node import GraphNode
from ja_common.head_description import BASE_FRAME, CAMERA_FRAME, describe_head
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    CAMERA_INFO,
    CLOCK,
    DEPTH,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    RIGHT_CAMERA_INFO,
    RIGHT_IMAGE,
    ROBOT_DESCRIPTION,
    SIM_TRUTH,
    Topic,
)
from ja_sim.core.camera import Observation
from ja_sim.core.pace import Pace
from ja_sim.core.scene import Scene, load_scene
from ja_sim.core.world import JointAttentionWorld
from ja_sim.truth_codec import encode_truth

CLOCK_RATE_HZ = 100.0
"""In real time the clock passes in steps of this rate [1/s of wall time], between images too."""

_T = TypeVar('_T')


@dataclass(frozen=True)
class SimConfig(Configuration):
    """Which world is simulated, and what advances its time."""

    scene: str = parameter('default', 'name of a scene, or path of a scene file (YAML)')
    seed: int = parameter(0, 'seed of every random draw', low=0)
    image_width: int = parameter(320, 'columns of the image [px]', low=32, high=4096)
    image_height: int = parameter(240, 'rows of the image [px]', low=24, high=4096)
    camera_rate_hz: float = parameter(10.0, 'images a second of simulated time', low=0.1, high=1e3)
    joint_states_per_image: int = parameter(1, 'joint states an image', low=1, high=100)
    lockstep: bool = parameter(
        True, 'step when the command for the last image has come (else: in real time)'
    )
    draw_ahead: bool = parameter(
        False,
        'in lockstep: draw the next picture while the robot processes the last: more images a '
        'second, and a command moves the head one picture later, as with a slower camera',
    )
    depth: str = parameter(
        'scene',
        'depth pictures: as in the scene, none, with the errors of a real sensor, or exact',
        choices=('scene', 'none', 'sensor', 'exact'),
    )
    depth_encoding: str = parameter(
        '16UC1',
        'depth pictures in whole millimetres (16UC1) or in metres (32FC1), as in REP-118',
        choices=DEPTH_ENCODINGS,
    )
    second_camera: str = parameter(
        'scene', 'a second camera to the right: as in the scene, on, or off',
        choices=('scene', 'on', 'off'),
    )  # fmt: skip
    photo: str = parameter(
        '', 'file (.npz) with the head of a photograph, which plays the caregiver; empty: as in '
        'the scene'
    )  # fmt: skip
    resend_after_s: float = parameter(
        0.5, 'in lockstep or a pause: time after which the last image is sent again',
        low=0.05, high=60.0,
    )  # fmt: skip


@dataclass(frozen=True)
class LiveConfig(Configuration):
    """Parameters that may change while the world runs."""

    objects: int = parameter(
        0,
        'number of objects; a change restarts the world; 0: as many as in the scene',
        low=0,
        high=10,
    )
    real_time_factor: float = parameter(
        0.0, 'simulated seconds a second; 0: as fast as commands come in lockstep, else 1',
        low=0.0, high=100.0,
    )  # fmt: skip


@dataclass(frozen=True)
class _Round:
    """The messages of one image."""

    clock: Clock
    truth: PointCloud2
    joint_states: list[JointState]
    senses: list[tuple[Topic, Image | CameraInfo]]
    camera_info: CameraInfo
    image: Image


class SimNode(GraphNode):
    """Publishes camera images and encoder readings, and follows `joint_commands`."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('sim', **node_kwargs)
        self._config = self.configure(SimConfig)
        self._live = self.configure(LiveConfig, self._on_live_config)
        joints = self.configure(JointConfig)
        self._joints = JointCodec(joints)
        # An OpenGL context belongs to one thread: this one makes the worlds and draws them.
        self._render_thread, self._closed = ThreadPoolExecutor(1, 'render'), False
        self._world = self._in_render_thread(self._make_world, self._live.objects)
        # The world's time restarts at zero after a reset; the time of the graph never goes back.
        self._time_offset_ns = 0
        self.subscribe(JOINT_COMMANDS, self._on_command, expected_every_s=2.0)
        self._simulated_time = self.create_topic_publisher(CLOCK)
        self._truth = self.create_topic_publisher(SIM_TRUTH)
        self._joint_states = self.create_topic_publisher(JOINT_STATES)
        self._camera_info = self.create_topic_publisher(CAMERA_INFO)
        self._senses = {
            topic: self.create_topic_publisher(topic)
            for topic in (DEPTH, RIGHT_CAMERA_INFO, RIGHT_IMAGE)
        }
        self._image = self.create_topic_publisher(IMAGE)
        self._publish_description(joints)
        self.advertise_service(Trigger, 'sim/reset', self._on_reset)
        self.advertise_service(SetBool, 'sim/pause', self._on_pause)
        self.advertise_service(Trigger, 'sim/step', self._on_step)
        self.advertise_service(Trigger, 'sim/rearrange', self._on_rearrange)

        self._command: NDArray[np.float64] | None = None
        self._was_answered = False
        self._ahead = self._config.lockstep and self._config.draw_ahead
        self._drawn: Future[_Round] | None = None
        self._round = self._next_round()
        self._published_s = -math.inf
        self._ticked_s = time.monotonic()
        self._clock_ns = 0
        self._steady = RosClock(clock_type=ClockType.STEADY_TIME)
        self._pace = Pace(self._config.lockstep)
        self._period_timer: Timer | None = None
        self._set_speed(self._live.real_time_factor)
        if not self._config.lockstep:
            self.create_timer(1 / CLOCK_RATE_HZ, self._advance_clock, clock=self._steady)
        self.create_timer(self._config.resend_after_s / 5, self._resend, clock=self._steady)

    def destroy_node(self) -> None:
        """Close the renderer, then the node."""
        if not self._closed:
            self._closed = True
            self._in_render_thread(self._world.close)
            self._render_thread.shutdown()
        super().destroy_node()

    def _publish_description(self, joints: JointConfig) -> None:
        head = self._world.scene.head
        max_speed = math.radians(head.speed_limit_deg_s) or None  # None: of the file
        description = describe_head(joints, self._world.limits, max_speed)
        self._robot_description = self.create_topic_publisher(ROBOT_DESCRIPTION)
        self._robot_description.publish(String(data=description))

    def _on_command(self, message: JointState) -> None:
        answers_image = message.header.stamp == self._round.image.header.stamp
        if self._config.lockstep and not answers_image:
            return  # an answer to an image sent twice, or a hold while the sim was paused
        posture = self._joints.decode_posture(message)
        if posture is None:
            raise ValueError('a command names no joints')
        self._command, self._was_answered = posture, True
        self._pace.record_answer()
        self._tick_if_due()

    def _on_period(self) -> None:
        self._pace.record_period()
        self._tick_if_due()

    def _tick_if_due(self) -> None:
        if self._pace.is_due:
            self._tick()

    def _tick(self) -> None:
        self._round = self._next_round()
        self._ticked_s = time.monotonic()
        self._pace.record_image()
        self._publish()

    def _next_round(self) -> _Round:
        """Return the next round, drawn now or ahead; if ahead, start to draw the one after it."""
        drawn = (self._drawn or self._draw()).result()
        self._drawn = self._draw() if self._ahead else None
        return drawn

    def _draw(self) -> Future[_Round]:
        """Start to draw the next round, in which the head follows the newest command."""
        command, self._command = self._command, None
        return self._render_thread.submit(self._advance, command)

    def _in_render_thread(self, work: Callable[..., _T], *args: Any) -> _T:
        return self._render_thread.submit(work, *args).result()

    def _resend(self) -> None:
        """Send the last image again.

        In lockstep, because a message may be lost; in a pause, so that no node reports silence.
        """
        silent_s = time.monotonic() - self._published_s
        stands = self._config.lockstep or self._pace.paused
        if silent_s < self._config.resend_after_s or not stands:
            return
        # At start-up nothing is lost; silence on `joint_commands` is reported by itself.
        if self._was_answered and not self._pace.answered:
            text = 'no command came for the last image; sending it again'
            self.report_problem('lockstep', text, Level.WARN)
        self._publish()

    def _advance(self, command: NDArray[np.float64] | None) -> _Round:
        if command is not None:
            self._world.command(command)
        parts = self._config.joint_states_per_image
        joint_states = []
        for _ in range(parts):
            self._world.step(1 / (self._config.camera_rate_hz * parts))
            sample = self._world.joint_state()
            header = self._header(sample.stamp_ns)
            joint_states.append(
                self._joints.encode_posture(header, sample.position, sample.velocity)
            )
        observation = self._world.observe()
        lens = observation.intrinsics
        header = self._header(observation.stamp_ns, CAMERA_FRAME)
        now = self._header(self._world.now_ns).stamp
        return _Round(
            Clock(clock=now),
            encode_truth(
                self._header(observation.stamp_ns, BASE_FRAME), self._world.truth_at_exposure()
            ),
            joint_states,
            self._encode_senses(observation, header),
            encode_camera_info(header, lens.width, lens.height, lens.fx, lens.fy),
            encode_image(observation.image, header.stamp, CAMERA_FRAME),
        )

    def _encode_senses(
        self, observation: Observation, header: Header
    ) -> list[tuple[Topic, Image | CameraInfo]]:
        """Return the messages of the senses that the scene has switched on."""
        messages: list[tuple[Topic, Image | CameraInfo]] = []
        stamp = header.stamp
        if observation.depth is not None:
            encoding = self._config.depth_encoding
            depth = encode_depth(observation.depth, encoding, stamp, CAMERA_FRAME)
            messages.append((DEPTH, depth))
        if observation.right is not None:
            lens, baseline_m = observation.intrinsics, self._world.scene.senses.baseline_m
            info = encode_camera_info(
                header, lens.width, lens.height, lens.fx, lens.fy, baseline_m
            )
            messages.append((RIGHT_CAMERA_INFO, info))
            messages.append((RIGHT_IMAGE, encode_image(observation.right, stamp, CAMERA_FRAME)))
        return messages

    def _publish(self) -> None:
        self._published_s = time.monotonic()
        self._publish_clock(to_ns(self._round.clock.clock))
        self._truth.publish(self._round.truth)
        for message in self._round.joint_states:
            self._joint_states.publish(message)
        # What belongs to an image comes before it: a subscriber to both need not wait.
        for topic, message in self._round.senses:
            self._senses[topic].publish(message)
        self._camera_info.publish(self._round.camera_info)
        self._image.publish(self._round.image)

    def _advance_clock(self) -> None:
        """Let time pass between two images, up to the next one, as the clock of a rig does."""
        if self._pace.paused:
            return
        passed_s = (time.monotonic() - self._ticked_s) * self._factor
        period_ns = NS_PER_S / self._config.camera_rate_hz
        ahead_ns = int(min(passed_s * NS_PER_S, period_ns - 1))
        self._publish_clock(to_ns(self._round.clock.clock) + ahead_ns)

    def _publish_clock(self, now_ns: int) -> None:
        # Never back: an image that is sent again in a pause is older than the clock.
        self._clock_ns = max(now_ns, self._clock_ns)
        self._simulated_time.publish(Clock(clock=to_time(self._clock_ns)))

    def _header(self, stamp_ns: int, frame_id: str = '') -> Header:
        return Header(stamp=to_time(stamp_ns + self._time_offset_ns), frame_id=frame_id)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._in_render_thread(self._world.reset, self._config.seed)
        self._restart()
        response.success, response.message = True, f'the world of seed {self._config.seed} again'
        return response

    def _restart(self) -> None:
        step_ns = int(NS_PER_S / self._config.camera_rate_hz)
        self._time_offset_ns = to_ns(self._round.clock.clock) + step_ns
        # A command to the old world, or a picture of it, does not belong to the new one.
        self._command = self._drawn = None
        self._tick()

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> Any:
        self._pace.set_paused(request.data)
        self.health.values['paused'] = str(request.data)
        self._tick_if_due()
        response.success, response.message = True, 'paused' if request.data else 'going on'
        return response

    def _on_step(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._pace.request_step()
        self._tick_if_due()
        response.success, response.message = True, 'one image'
        return response

    def _on_rearrange(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._in_render_thread(self._world.rearrange)
        response.success, response.message = True, 'the objects have other places'
        return response

    def _on_live_config(self, config: LiveConfig) -> None:
        if config.real_time_factor != self._live.real_time_factor:
            self._set_speed(config.real_time_factor)
        if config.objects != self._live.objects:
            self._set_objects(config.objects)
        self._live = config

    def _set_speed(self, real_time_factor: float) -> None:
        if self._period_timer is not None:
            self.destroy_timer(self._period_timer)
            self._period_timer = None
        factor = real_time_factor or (0.0 if self._config.lockstep else 1.0)
        self._factor = factor
        self._pace.has_timer = factor > 0.0
        if factor:
            period_s = 1 / (self._config.camera_rate_hz * factor)
            self._period_timer = self.create_timer(period_s, self._on_period, clock=self._steady)
        self._tick_if_due()

    def _set_objects(self, count: int) -> None:
        try:
            world = self._in_render_thread(self._make_world, count)
        except ConfigError as error:
            self.report_problem('objects', f'the world is unchanged: {error}')
            return
        self._in_render_thread(self._world.close)
        self._world = world
        self._restart()

    def _make_world(self, objects: int) -> JointAttentionWorld:
        scene = self._with_senses(load_scene(self._config.scene))
        if self._config.photo:
            scene = replace(scene, caregiver=replace(scene.caregiver, photo=self._config.photo))
        if objects:
            scene = replace(scene, objects=replace(scene.objects, count=objects))
        self.health.values['objects'] = str(scene.objects.count)
        size = (self._config.image_width, self._config.image_height)
        return JointAttentionWorld(scene, self._config.seed, image_size=size)

    def _with_senses(self, scene: Scene) -> Scene:
        """Return the scene with the senses that the parameters switch on or off."""
        senses, config = scene.senses, self._config
        if config.depth != 'scene':
            senses = replace(senses, depth=config.depth)
        if config.second_camera != 'scene':
            senses = replace(senses, second_camera=config.second_camera == 'on')
        return replace(scene, senses=senses)


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(SimNode, args)


if __name__ == '__main__':
    main()
