"""`sim`: the simulated world as a camera and a pan-tilt head on ROS topics."""

import math
import time
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from ja_common.core.config import parameter
from ja_common.core.health import Level
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode, spin_node
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.time_codec import to_ns, to_time
from ja_common.topics import (
    CAMERA_INFO,
    CLOCK,
    IMAGE,
    JOINT_COMMANDS,
    JOINT_STATES,
    SIM_TRUTH,
)
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld, Observation
from ja_sim.truth_codec import encode_truth

CAMERA_FRAME = 'camera_optical_frame'


@dataclass(frozen=True)
class SimConfig:
    """Which world, and how its time passes."""

    scene: str = parameter('default', 'name of a scene, or path of a scene file (YAML)')
    seed: int = parameter(0, 'seed of everything that is drawn', low=0)
    image_width: int = parameter(320, 'columns of the image [px]', low=32, high=4096)
    image_height: int = parameter(240, 'rows of the image [px]', low=24, high=4096)
    camera_rate_hz: float = parameter(10.0, 'images a second of simulated time', low=0.1, high=1e3)
    joint_states_per_image: int = parameter(1, 'joint states an image', low=1, high=100)
    lockstep: bool = parameter(
        True, 'step when the command for the last image has come (else: in real time)'
    )
    real_time_factor: float = parameter(
        1.0, 'simulated seconds a second when not in lockstep', low=0.01, high=100.0
    )
    resend_after_s: float = parameter(
        0.5, 'in lockstep: send the last image again when no command came for so long',
        low=0.05, high=60.0,
    )  # fmt: skip


@dataclass(frozen=True)
class _Round:
    """The messages of one image."""

    clock: Clock
    truth: PointCloud2
    joint_states: list[JointState]
    camera_info: CameraInfo
    image: Image


class SimNode(GraphNode):
    """Publishes what camera and encoders give, and obeys `joint_commands`."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('sim', **node_kwargs)
        self._config = self.configure(SimConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        size = (self._config.image_width, self._config.image_height)
        self._world = JointAttentionWorld(
            load_scene(self._config.scene), self._config.seed, image_size=size
        )
        # The world's time starts at nought after a reset; the time of the graph never goes back.
        self._time_offset_ns = 0
        self.hear(JOINT_COMMANDS, self._on_command, expected_every_s=2.0)
        self._simulated_time = self.say(CLOCK)
        self._truth = self.say(SIM_TRUTH)
        self._joint_states = self.say(JOINT_STATES)
        self._camera_info = self.say(CAMERA_INFO)
        self._image = self.say(IMAGE)
        self.offer(Trigger, 'sim/reset', self._on_reset)

        self._round = self._advance()
        self._published_s = -math.inf
        steady = RosClock(clock_type=ClockType.STEADY_TIME)
        if self._config.lockstep:
            self.create_timer(self._config.resend_after_s / 5, self._resend, clock=steady)
        else:
            period_s = 1 / (self._config.camera_rate_hz * self._config.real_time_factor)
            self.create_timer(period_s, self._tick, clock=steady)

    def destroy_node(self) -> None:
        """Close the renderer, then the node."""
        self._world.close()
        super().destroy_node()

    def _on_command(self, message: JointState) -> None:
        answers_image = message.header.stamp == self._round.image.header.stamp
        if self._config.lockstep and not answers_image:
            return  # an answer to an image sent twice, or a hold while the sim stood still
        posture = self._joints.decode(message)
        if posture is None:
            raise ValueError('a command names no joints')
        self._world.command(posture)
        if self._config.lockstep:
            self._tick()

    def _tick(self) -> None:
        self._round = self._advance()
        self._publish()

    def _resend(self) -> None:
        silent_s = time.monotonic() - self._published_s
        if silent_s < self._config.resend_after_s:
            return
        if math.isfinite(silent_s):
            text = 'no command came for the last image; sending it again'
            self.problem('lockstep', text, Level.WARN)
        self._publish()

    def _advance(self) -> _Round:
        parts = self._config.joint_states_per_image
        joint_states = []
        for _ in range(parts):
            self._world.step(1 / (self._config.camera_rate_hz * parts))
            sample = self._world.joint_state()
            header = self._header(sample.stamp_ns)
            joint_states.append(self._joints.encode(header, sample.position, sample.velocity))
        observation = self._world.observe()
        header = self._header(observation.stamp_ns, CAMERA_FRAME)
        now = self._header(self._world.now_ns).stamp
        return _Round(
            Clock(clock=now),
            encode_truth(header, self._world.truth()),
            joint_states,
            _camera_info(header, observation),
            encode_image(observation.image, header.stamp, CAMERA_FRAME),
        )

    def _publish(self) -> None:
        self._published_s = time.monotonic()
        self._simulated_time.publish(self._round.clock)
        self._truth.publish(self._round.truth)
        for message in self._round.joint_states:
            self._joint_states.publish(message)
        self._camera_info.publish(self._round.camera_info)
        self._image.publish(self._round.image)

    def _header(self, stamp_ns: int, frame_id: str = '') -> Header:
        return Header(stamp=to_time(stamp_ns + self._time_offset_ns), frame_id=frame_id)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        step_ns = int(NS_PER_S / self._config.camera_rate_hz)
        self._time_offset_ns = to_ns(self._round.clock.clock) + step_ns
        self._world.reset(self._config.seed)
        self._tick()
        response.success, response.message = True, f'the world of seed {self._config.seed} again'
        return response


def _camera_info(header: Header, observation: Observation) -> CameraInfo:
    lens = observation.intrinsics
    fx, fy, cx, cy = lens.fx, lens.fy, lens.cx, lens.cy
    return CameraInfo(
        header=header,
        width=lens.width,
        height=lens.height,
        distortion_model='plumb_bob',
        d=[0.0] * 5,
        k=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(SimNode, args)


if __name__ == '__main__':
    main()
