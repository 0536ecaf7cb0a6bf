"""`gate`: arbitrates between visual feedback and the learner, and alone commands the head."""

import time
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import parameter
from ja_common.core.health import Level
from ja_common.core.posture import Posture
from ja_common.core.stamp_join import StampJoin
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode, spin_node
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.posture_listener import PostureListener
from ja_common.time_codec import to_ns
from ja_common.topics import (
    FACE_DELTA,
    FIXATION,
    GATE_STATUS,
    JOINT_COMMANDS,
    JOINT_STATES,
    LM_DELTA,
    VF_DELTA,
    Topic,
)
from ja_control.core.attention_cycle import (
    AttentionCycle,
    AttentionCycleConfig,
    Decision,
    Percept,
)
from ja_control.core.gating import Gating, GatingConfig
from ja_control.core.joint_limits import JointLimits, JointLimitsConfig

_PROPOSALS = (VF_DELTA, FACE_DELTA, LM_DELTA, FIXATION)


@dataclass(frozen=True)
class GateConfig:
    """What the gate needs beyond the cycle, the gating and the limits."""

    seed: int = parameter(0, 'seed of the draws between VF and LM', low=0)
    enabled_at_start: bool = parameter(True, 'move from the start, without a call of `enable`')
    stale_after_s: float = parameter(
        0.5, 'hold when the newest image is older, or an input silent for longer',
        low=0.02, high=60.0,
    )  # fmt: skip


class GateNode(GraphNode):
    """One command for every image on which all proposals have come; holds when they do not."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('gate', **node_kwargs)
        self._config = self.configure(GateConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        self._limits = JointLimits(self.configure(JointLimitsConfig, self._set_limits))
        self._cycle = AttentionCycle(
            self.configure(AttentionCycleConfig, self._set_cycle),
            Gating(self.configure(GatingConfig, self._set_gating)),
            np.random.default_rng(self._config.seed),
        )
        self._enabled = self._config.enabled_at_start

        self._postures = PostureListener(self, self._joints)
        self._join = StampJoin([topic.name for topic in _PROPOSALS])
        self._last_stamp_ns = 0
        self._last_command: JointState | None = None
        self._commanded = np.full(2, np.nan)
        self._heard_all_s = time.monotonic()
        self._holding = ''

        for topic in _PROPOSALS:
            self.hear(topic, self._collector(topic), expected_every_s=2.0)
        self._commands = self.say(JOINT_COMMANDS)
        self._status = self.say(GATE_STATUS)
        self.offer(SetBool, 'enable', self._on_enable)
        self.offer(Trigger, 'home', self._on_home)
        self.create_timer(0.1, self._hold_if_silent, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _set_limits(self, config: JointLimitsConfig) -> None:
        self._limits = JointLimits(config)

    def _set_cycle(self, config: AttentionCycleConfig) -> None:
        self._cycle.config = config

    def _set_gating(self, config: GatingConfig) -> None:
        self._cycle.gating = Gating(config)

    def _collector(self, topic: Topic) -> Any:
        def collect(message: JointState) -> None:
            stamp_ns = to_ns(message.header.stamp)
            proposals = self._join.add(topic.name, stamp_ns, self._joints.decode(message))
            if proposals is not None:
                self._postures.when_known(stamp_ns, partial(self._act, message.header, proposals))

        return collect

    def _act(self, header: Header, proposals: dict[str, Any], posture: Posture) -> None:
        self._heard_all_s = time.monotonic()
        stamp_ns = posture.stamp_ns
        answered = self._last_command is not None and stamp_ns == self._last_stamp_ns
        if answered and not self._holding:
            # The same image again (a sim that lost the answer): the same answer again.
            self._commands.publish(self._last_command)
            return
        seconds = (stamp_ns - self._last_stamp_ns) / NS_PER_S
        if -1.0 < seconds < 0.0:
            return  # late: a newer image has been answered already
        reason = self._reason_to_hold(stamp_ns)
        if reason:
            self._hold(header, reason)
        else:
            if seconds < 0.0 or self._holding or self._last_command is None:
                # The clock was set back, or the head was held: start from where it stands.
                self._cycle.restart()
                self._commanded = self._where_it_stands()
                seconds = 0.0
            self._holding = ''
            percept = Percept(
                posture,
                face_delta=proposals[FACE_DELTA.name],
                vf_delta=proposals[VF_DELTA.name],
                lm_delta=proposals[LM_DELTA.name],
                fixation=proposals[FIXATION.name],
            )
            # A clock set forward is no time in which the head could have turned.
            seconds = min(seconds, self._config.stale_after_s)
            self._command(header, self._cycle.step(percept), seconds)
        self._last_stamp_ns = stamp_ns

    def _reason_to_hold(self, stamp_ns: int) -> str:
        if not self._enabled:
            return 'disabled'
        age_s = (self.get_clock().now().nanoseconds - stamp_ns) / NS_PER_S
        if age_s > self._config.stale_after_s:
            return f'the newest image is {age_s:.1f} s old'
        return ''

    def _command(self, header: Header, decision: Decision, seconds: float) -> None:
        limited = self._limits.limit(decision.target, self._commanded, seconds)
        self._publish(header, limited.posture)
        self._tell(Level.OK, decision.phase.value, decision, clamped=limited.clamped)

    def _hold(self, header: Header, reason: str) -> None:
        posture = self._commanded if self._holding else self._where_it_stands()
        self._holding = reason
        self._publish(header, posture)
        self._tell(Level.WARN, f'hold: {reason}', None, reason=reason)

    def _where_it_stands(self) -> np.ndarray:
        # Now, not at the image's stamp: an image may be old, and so would be its posture.
        newest = self._postures.newest
        assert newest is not None, 'nothing is commanded before a joint state has come'
        return self._limits.clip(newest.position)

    def _publish(self, header: Header, posture: np.ndarray) -> None:
        self._commanded = posture
        self._last_command = self._joints.encode(header, posture)
        self._commands.publish(self._last_command)

    def _tell(self, level: Level, message: str, decision: Decision | None, **more: str) -> None:
        values = {'trials': str(self._cycle.trials), 'enabled': str(self._enabled), **more}
        if decision is not None:
            values |= {
                'phase': decision.phase.value,
                'source': decision.source.value,
                'p_lm': f'{decision.p_lm:.4f}',
                'shifts': str(decision.shifts),
            }
        self._status.publish(
            DiagnosticStatus(
                level=bytes([level]),
                name=self.get_fully_qualified_name(),
                message=message,
                values=[KeyValue(key=key, value=value) for key, value in values.items()],
            )
        )

    def _hold_if_silent(self) -> None:
        silent_s = time.monotonic() - self._heard_all_s
        if silent_s < self._config.stale_after_s or self._holding:
            return
        if self._last_command is None:
            return  # nothing was ever commanded
        missing = [JOINT_STATES.name] if self._postures.is_behind else self._join.missing()
        reason = f'no {", ".join(sorted(missing))} for {silent_s:.1f} s'
        self.problem('hold', f'holding the head where it is: {reason}', Level.WARN)
        self._hold(Header(stamp=self.get_clock().now().to_msg()), reason)

    def _on_enable(self, request: SetBool.Request, response: SetBool.Response) -> Any:
        self._enabled = request.data
        response.success = True
        response.message = 'enabled' if request.data else 'disabled: the head holds its posture'
        return response

    def _on_home(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        if not self._enabled:
            raise ValueError('the gate is disabled: call enable first')
        self._cycle.go_home()
        response.success, response.message = True, 'turning to the home posture'
        return response


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(GateNode, args)


if __name__ == '__main__':
    main()
