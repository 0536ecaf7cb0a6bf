"""`gate`: chooses between visual feedback and the learner; only it commands the head."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header, String
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.joint_track import REORDERED_WITHIN_S
from ja_common.core.posture import Posture
from ja_common.core.stamps import NS_PER_S
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.point_cloud_codec import decode_columns
from ja_common.reported_save import ReportedSave
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.time_codec import to_time
from ja_common.topics import (
    EVIDENCE,
    FACE_DELTA,
    FIXATION,
    GATE_STATUS,
    GLANCE_DELTA,
    INTERRUPTED,
    JOINT_STATES,
    LM_DELTA,
    ROBOT_DESCRIPTION,
    VF_DELTA,
)
from ja_control.command_output import CommandOutput, CommandOutputConfig
from ja_control.core.attention_cycle import (
    AttentionCycle,
    AttentionCycleConfig,
    CycleInput,
    Decision,
)
from ja_control.core.command_guard import Command, CommandGuard, CommandGuardConfig
from ja_control.core.gating import Gating, GatingConfig
from ja_control.core.hold import Cause, Hold
from ja_control.core.joint_limits import JointLimitsConfig
from ja_control.core.look_at import LookAtConfig
from ja_control.core.trial_count import load_trials, save_trials
from ja_control.core.urdf_joint import read_joint
from ja_control.core.urdf_limits import narrow_limits
from ja_control.gate_status import describe_unseen, encode_gate_status
from ja_control.look_at_input import LookAtInput

_PROPOSALS = (VF_DELTA, FACE_DELTA, LM_DELTA, GLANCE_DELTA, FIXATION)
_EVIDENCE_COLUMNS = ('log_evidence', 'expected_gain')
# Longer than any image takes: the head does not turn in the time of a clock set forward.
_LONGEST_STEP_S = 2.0
_STATUS_EVERY_S = 0.1


@dataclass(frozen=True)
class GateConfig(Configuration):
    """What the gate needs beyond the cycle, the gating and the guard."""

    seed: int = parameter(0, 'seed of the draws between VF and LM', low=0)
    enabled_at_start: bool = parameter(
        True, 'move from the start, without a call of `gate/enable`'
    )
    lockstep: bool = parameter(
        False,
        'take the time from the images: one command an image, and no input is ever late '
        '(else: commands at control_rate_hz, with or without images)',
    )
    control_rate_hz: float = parameter(
        200.0, 'commands a second, and steps of the motion profile', low=10.0, high=500.0
    )
    limits_from: str = parameter(
        'parameters',
        'where the joint limits come from; with a URDF the narrower of both hold, and the head '
        'is held until it has come',
        choices=('parameters', 'robot_description'),
    )
    trials_file: str = parameter(
        '',
        'file that keeps the count of trials over a restart, in a separate folder for each '
        'namespace; empty: the count is not kept',
    )


class GateNode(GraphNode):
    """Takes one decision for every image with all its proposals, and commands the head by it.

    In real time a steady timer steps the guard. A command carries the header of the image that it
    follows, or the time of the clock while the head is held.
    """

    refuses_unknown_parameters = True

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('gate', **node_kwargs)
        self._config = self.configure(GateConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        self._limits = self.configure(JointLimitsConfig, self._set_limits)
        self._urdf = ''
        self._guard = CommandGuard(
            self._limits,
            self.configure(CommandGuardConfig, self._set_guard),
            1.0 / self._config.control_rate_hz,
            self._config.enabled_at_start,
        )
        self._cycle = AttentionCycle(
            self.configure(AttentionCycleConfig, self._set_cycle),
            Gating(self.configure(GatingConfig, self._set_gating)),
            np.random.default_rng(self._config.seed),
            lambda target: self._guard.limits.reachable(target),
        )
        kept = Path(self._config.trials_file)
        self._trials_file = self.namespaced_folder(kept.parent) / kept.name
        self._cycle.trials = self._load_trials()
        self._trials_save: ReportedSave | None = None
        if self._config.trials_file:
            self._trials_save = ReportedSave(self, 'trials_file', self._save_trials)
            self._trials_save.request()  # now, so that a bad place shows before the first trial

        self._header = Header()
        self._stamp_ns = 0
        self._decision: Decision | None = None
        self._answer: JointState | None = None
        self._guard_hold: Hold | None = None
        self._hold: Hold | None = None
        self._status_s = -np.inf
        self._has_decided = False

        self._synchroniser = Synchroniser(self, self._joints)
        deltas = dict.fromkeys(_PROPOSALS, self._joints.decode)
        self._synchroniser.call_with({**deltas, EVIDENCE: _decode_evidence}, self._act)
        self._look_at = LookAtInput(
            self,
            self.configure(LookAtConfig),
            self._synchroniser.history,
            self._check_point,
            lambda direction: self._guard.limits.reachable(direction),
            self._turn_to,
        )
        self._interrupted = self.create_topic_publisher(INTERRUPTED)
        self._output = CommandOutput(self, self.configure(CommandOutputConfig))
        self._status = self.create_topic_publisher(GATE_STATUS)
        self.advertise_renamed_service(SetBool, 'gate/enable', 'enable', self._on_enable)
        self.advertise_renamed_service(Trigger, 'gate/home', 'home', self._on_home)
        self.advertise_service(Trigger, 'gate/clear_look_at', self._on_clear_look_at)
        if self._config.limits_from == 'robot_description':
            self._guard.blocked = f'no {ROBOT_DESCRIPTION.name} yet'
            self.subscribe(ROBOT_DESCRIPTION, self._on_robot_description)
        if not self._config.lockstep:
            steady = Clock(clock_type=ClockType.STEADY_TIME)
            self.create_timer(1.0 / self._config.control_rate_hz, self._on_period, clock=steady)

    def _set_limits(self, config: JointLimitsConfig) -> None:
        self._limits = config
        if self._urdf:
            self._narrow_limits()
        else:
            self._guard.set_limits(config)

    def _set_guard(self, config: CommandGuardConfig) -> None:
        self._guard.config = config

    def _set_cycle(self, config: AttentionCycleConfig) -> None:
        self._cycle.config = config

    def _set_gating(self, config: GatingConfig) -> None:
        self._cycle.gating = Gating(config)

    def _load_trials(self) -> int:
        if not self._config.trials_file:
            return 0
        try:
            return load_trials(self._trials_file)
        except ValueError as error:
            raise ConfigError(f'trials_file: {error}') from None

    def _save_trials(self) -> None:
        save_trials(self._trials_file, self._cycle.trials)

    def destroy_node(self) -> None:
        """Save the count of trials, then end."""
        if self._trials_save is not None:
            self._trials_save.close()
        super().destroy_node()

    def _on_robot_description(self, message: String) -> None:
        self._urdf = message.data
        self._guard.blocked = f'{ROBOT_DESCRIPTION.name} cannot be used'
        try:
            self._narrow_limits()
        except ValueError as error:
            self._guard.blocked += f': {error}'
            raise
        self._guard.blocked = ''

    def _narrow_limits(self) -> None:
        pan, tilt = (read_joint(self._urdf, name) for name in self._joints.names)
        joints = self._joints
        narrowed = narrow_limits(self._limits, pan, tilt, joints.signs, joints.offsets)
        self._guard.set_limits(narrowed.config)
        texts = {'joint limits': narrowed.sources, 'robot description': '; '.join(narrowed.notes)}
        for key, text in texts.items():
            if text != self.health.values.get(key, ''):
                self.get_logger().info(f'{key}: {text}')
            self.health.values[key] = text

    def _act(self, found: StampedSet) -> None:
        """Decide on an image with all its proposals, and command the head in lockstep."""
        posture = found.posture
        lockstep = self._config.lockstep
        step_s = (posture.stamp_ns - self._stamp_ns) / NS_PER_S
        if step_s == 0.0:
            # The same image again (the sim lost the answer): the same answer again.
            if lockstep and self._answer is not None:
                self._output.publish(self._answer)
            return
        if -REORDERED_WITHIN_S < step_s < 0.0:
            return  # late: a newer image was answered already
        if step_s < 0.0:
            self._guard.restart()  # the clock was set back
        self._header, self._stamp_ns = found.header, posture.stamp_ns
        now_s = self._now_s()
        self._guard.record_image(now_s, self._age_s(posture.stamp_ns))
        self._look_at.use_waiting()
        try:
            self._decision = self._decide(found)
        finally:
            # Also after an error: without an answer the sim would stand still for ever.
            if lockstep:
                seconds = min(max(step_s, 0.0), _LONGEST_STEP_S)
                # Not the newest posture: which one that is depends on the scheduling.
                self._step(now_s, posture, max(1, round(seconds * self._config.control_rate_hz)))

    def _decide(self, found: StampedSet) -> Decision | None:
        if not self._guard.engaged:
            self._cycle.restart()
            if self._has_decided:  # before the first image there was no trial
                self._interrupt_trial()
            self._has_decided = True
            return None
        trials = self._cycle.trials
        decision = self._cycle.step(
            CycleInput(
                found.posture,
                face_delta=found[FACE_DELTA],
                vf_delta=found[VF_DELTA],
                lm_delta=found[LM_DELTA],
                glance_delta=found[GLANCE_DELTA],
                fixation=found[FIXATION],
                log_evidence=found[EVIDENCE][0],
                expected_gain=found[EVIDENCE][1],
            )
        )
        self._guard.set_target(decision.target)
        if self._cycle.is_interrupted:
            self._interrupt_trial()
        if decision.trials != trials and self._trials_save is not None:
            self._trials_save.request()
        return decision

    def _interrupt_trial(self) -> None:
        """Publish that no trial with a look at the newest image, or before it, counts."""
        self._interrupted.publish(Header(stamp=to_time(self._stamp_ns)))

    def _check_point(self, stamp_ns: int) -> None:
        """Raise ValueError while the head cannot turn to a point with this stamp."""
        if not self._guard.enabled:
            raise ValueError('the gate is disabled: call gate/enable first')
        if not self._guard.engaged:
            reason = f': {self._hold.text}' if self._hold is not None else ''
            raise ValueError(f'the head is held{reason}')
        if stamp_ns == 0:
            return  # as in tf: now
        # In lockstep the images give the time.
        lockstep = self._config.lockstep
        now_ns = self._stamp_ns if lockstep else self.get_clock().now().nanoseconds
        age_s, stale_after_s = (now_ns - stamp_ns) / NS_PER_S, self._guard.config.stale_after_s
        if age_s > stale_after_s:
            raise ValueError(
                f'the point is {age_s:.3g} s old: stamp it with the time for which it holds, or '
                f'with 0 for now (stale_after_s is {stale_after_s:g})'
            )
        if age_s < -stale_after_s:
            raise ValueError(
                f'the point is stamped {-age_s:.3g} s ahead of the clock of the gate: synchronise '
                'the clocks, and set use_sim_time in both nodes or in none'
            )

    def _turn_to(self, direction: NDArray[np.float64]) -> None:
        self._cycle.look_at(direction)
        self._interrupt_trial()

    def _now_s(self) -> float:
        # In lockstep time passes from image to image; on a rig it always passes.
        return self._stamp_ns / NS_PER_S if self._config.lockstep else time.monotonic()

    def _age_s(self, stamp_ns: int) -> float:
        if self._config.lockstep:
            return 0.0
        return (self.get_clock().now().nanoseconds - stamp_ns) / NS_PER_S

    def _on_period(self) -> None:
        self._look_at.use_waiting()
        try:
            self._step(self._now_s(), self._synchroniser.newest_posture, 1)
        except ValueError as error:
            self.report_problem('control', f'control: {error}')

    def _step(self, now_s: float, measured: Posture | None, periods: int) -> None:
        if measured is not None:
            self._guard.record_joints(measured.position, now_s, self._age_s(measured.stamp_ns))
        self._guard.other_commander = self._output.find_other_commander()
        command = self._guard.step(now_s, periods)
        changed = self._update_hold(command.hold)
        if self._config.lockstep and command.position is None and measured is not None:
            # The sim waits for an answer even while the head is held.
            command = replace(command, position=measured.position)
        if command.position is not None:
            self._publish_command(command)
        due = self._config.lockstep or now_s - self._status_s >= _STATUS_EVERY_S
        if changed or due or self._decision is not None:
            self._publish_status(command)
            self._status_s = now_s
            self._decision = None

    def _publish_command(self, command: Command) -> None:
        assert command.position is not None
        header = self._header
        if command.hold is not None and not self._config.lockstep:
            header = Header(stamp=self.get_clock().now().to_msg(), frame_id=header.frame_id)
        self._answer = self._joints.encode_posture(header, command.position, command.velocity)
        self._output.publish(self._answer)

    def _update_hold(self, hold: Hold | None) -> bool:
        """Keep why the head is held, with the missing topics; return whether this has changed."""
        changed, self._guard_hold = hold != self._guard_hold, hold
        if changed and hold is not None and hold.cause is Cause.SILENT:
            behind = self._synchroniser.waits_for_posture
            missing = (
                [JOINT_STATES.name] if behind else sorted(self._synchroniser.missing_topics())
            )
            hold = Hold(hold.cause, f'{hold.text}; missing: {", ".join(missing)}')
        if changed:
            self._hold = hold
        if self._hold is None:
            self.health.clear_problem('hold')
        else:
            self.report_problem('hold', f'holding the head: {self._hold.text}', self._hold.level)
        return changed

    def _publish_status(self, command: Command) -> None:
        self.health.values['person'] = describe_unseen(self._cycle) or 'no person is missing'
        self._status.publish(
            encode_gate_status(
                self.get_fully_qualified_name(),
                self._cycle,
                enabled=self._guard.enabled,
                clamped=command.clamped,
                hold=self._hold,
                decision=self._decision,
            )
        )

    def _on_enable(self, request: SetBool.Request, response: SetBool.Response) -> Any:
        self._guard.enable(request.data)
        if not request.data:
            self._end_look_at()
        response.success = True
        response.message = 'enabled' if request.data else 'disabled: the head holds its posture'
        return response

    def _on_home(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        if not self._guard.enabled:
            raise ValueError('the gate is disabled: call gate/enable first')
        self._look_at.drop_waiting()
        self._cycle.go_home()
        self._interrupt_trial()
        response.success, response.message = True, 'turning to the home posture'
        return response

    def _on_clear_look_at(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        response.success, response.message = True, 'the head looked at no point'
        if self._end_look_at():
            response.message = 'looking at the caregiver again'
        return response

    def _end_look_at(self) -> bool:
        self._look_at.drop_waiting()
        return self._cycle.end_look_at()


def _decode_evidence(message: PointCloud2) -> tuple[float, float]:
    """Return log evidence and expected gain; the gain is NaN where it is unknown or missing."""
    known = [field.name for field in message.fields if field.name in _EVIDENCE_COLUMNS]
    columns = decode_columns(message, list(dict.fromkeys(['log_evidence', *known])))
    evidence, gain = columns['log_evidence'], columns.get('expected_gain', np.full(1, np.nan))
    if evidence.shape != (1,) or not np.isfinite(evidence[0]):
        raise ValueError(f'{EVIDENCE.name} must be one finite number, found {evidence}')
    if gain.shape != (1,) or gain[0] < 0 or gain[0] > 1:  # NaN is neither: it is unknown
        raise ValueError(f'expected_gain must be one number from 0 to 1, found {gain}')
    return float(evidence[0]), float(gain[0])


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(GateNode, args)


if __name__ == '__main__':
    main()
