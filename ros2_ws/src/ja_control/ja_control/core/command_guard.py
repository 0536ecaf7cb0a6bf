"""The guard of the commands: every command is safe, and missing input holds the head.

The checks, in this order: no other node may command the head; a target must be finite; the inputs
must be fresh; a target within the dead zone of the last one is ignored; the motion profile limits
speed and acceleration, relative to the *previous command*; targets keep a soft margin to the
position limits, which only braking may use. After every hold the command restarts at the measured
posture, at rest.

Time is any clock that only runs forward, in seconds; if it runs back, all inputs are discarded.
Comparisons are written so that NaN fails them: what cannot be compared is neither fresh nor near.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ja_common.core.config import Configuration, parameter
from ja_common.core.geometry import finite_pair
from ja_control.core.hold import Cause, Hold
from ja_control.core.joint_limits import JointLimits, JointLimitsConfig
from ja_control.core.motion_profile import MotionProfile
from ja_control.core.stall_watch import StallWatch


@dataclass(frozen=True)
class CommandGuardConfig(Configuration):
    """When the head is held, and when it moves again."""

    dead_zone_rad: float = parameter(
        0.003, 'a joint keeps its last target when the new one is no farther from it than this',
        low=0.0, high=0.2,
    )  # fmt: skip
    stale_after_s: float = parameter(
        0.5, 'hold when the newest image or joint state is older', low=0.02, high=60.0
    )
    hold_after_s: float = parameter(
        0.13,
        'hold when the proposals for an image have not been complete for so long',
        low=0.02,
        high=60.0,
    )
    stall_error_rad: float = parameter(
        0.1, 'a joint farther than this from its command must come nearer', low=0.01, high=3.0
    )
    stall_after_s: float = parameter(
        0.3, 'hold when it has not come nearer for so long', low=0.05, high=10.0
    )
    retry_after_s: float = parameter(
        2.0, 'time for which a stalled head is left alone', low=0.1, high=3600.0
    )
    outside_rad: float = parameter(
        0.3,
        'a head found outside its limits by less is brought back in; by more it is not moved',
        low=0.0, high=1.57,
    )  # fmt: skip
    latch_faults: bool = parameter(
        False,
        'after a hold wait for a call of `gate/enable` (else: resume when the cause is gone)',
    )


@dataclass(frozen=True)
class Command:
    """What to send: position (2,) [rad] and velocity (2,) [rad/s] of (pan, tilt).

    `position` is None while nothing may be sent: until the head moves for the first time, and at
    rest while another node commands it.
    `clamped` names the limits that cut the motion ('' for none), `hold` why the head is held.
    """

    position: NDArray[np.float64] | None
    velocity: NDArray[np.float64]
    clamped: str
    hold: Hold | None


class CommandGuard:
    """Turns targets into safe commands: call `step` once a control period.

    The caller may hold the head: `other_commander` names the nodes that command it as well, and
    `blocked` is any other reason; '' for none. Raises ValueError for a period that is no time.
    """

    def __init__(
        self,
        limits: JointLimitsConfig,
        config: CommandGuardConfig,
        period_s: float,
        enabled: bool = True,
    ) -> None:
        if not 0.0 < period_s < math.inf:
            raise ValueError(f'the control period must be a time > 0, got {period_s} s')
        self.limits = JointLimits(limits)
        self.config = config
        self.other_commander = ''
        self.blocked = ''
        self._limits_config = limits
        self._new_limits: JointLimitsConfig | None = None
        self._period_s = period_s
        self._enabled = enabled
        self._latched: Hold | None = None
        self._joints: list[MotionProfile] | None = None
        self._target = np.zeros(2)
        self._stall_watch = StallWatch()
        self._measured: NDArray[np.float64] | None = None
        self._now_s = -math.inf
        self._discard_inputs()

    @property
    def engaged(self) -> bool:
        """Return whether the head follows targets: not in a hold, nor before its restart."""
        return self._engaged

    @property
    def enabled(self) -> bool:
        """Return whether motion is allowed, as set by `enable`."""
        return self._enabled

    def enable(self, enabled: bool) -> None:
        """Allow motion or forbid it; allowing it releases a latched hold."""
        self._enabled = enabled
        if enabled:
            self._latched = None
            self._stalled_until_s = -math.inf

    def set_limits(self, limits: JointLimitsConfig) -> None:
        """Set new limits; they apply once the head, braked by the old ones, stands still."""
        self._new_limits = limits

    def restart(self) -> None:
        """Brake, and restart from the measured posture."""
        self._engaged = False

    def record_image(self, now_s: float, age_s: float) -> None:
        """Record that all proposals for an image of this age [s] have come."""
        self._advance_clock(now_s)
        self._complete_s = now_s
        self._image_s = now_s - age_s

    def record_joints(self, position: ArrayLike, now_s: float, age_s: float) -> None:
        """Record the newest measured posture (2,) [rad] and its age [s].

        Raises ValueError when it is not finite.
        """
        measured = finite_pair('measured posture', position)
        self._advance_clock(now_s)
        self._measured = measured
        self._measured_s = now_s - age_s

    def set_target(self, target: ArrayLike) -> None:
        """Set the posture to go to, (2,) [rad].

        Raises ValueError when it is not finite; the last target then stays.
        """
        target = finite_pair('target posture', target)
        far = np.abs(target - self._target) > self.config.dead_zone_rad
        self._target = np.where(far, target, self._target)

    def step(self, now_s: float, periods: int = 1) -> Command:
        """Return the command for now; the profile advances by so many control periods."""
        self._advance_clock(now_s)
        hold = self._find_hold()
        if hold is not None:
            self._enter_hold(hold)
        cut: set[str] = set()
        for _ in range(periods):
            self._advance(hold, cut)
        if hold is None and not np.array_equal(self.limits.reachable(self._target), self._target):
            cut.add('position')
        if self._joints is None:
            return Command(None, np.zeros(2), '', hold)
        return Command(
            np.array([joint.position for joint in self._joints]),
            np.array([joint.velocity for joint in self._joints]),
            ' and '.join(sorted(cut)),
            hold,
        )

    def _advance_clock(self, now_s: float) -> None:
        if not self._now_s <= now_s < math.inf:
            self._discard_inputs()
        self._now_s = now_s if math.isfinite(now_s) else -math.inf

    def _discard_inputs(self) -> None:
        self._measured = None
        self._measured_s = self._image_s = self._complete_s = -math.inf
        self._stalled_until_s = -math.inf
        self._engaged = False

    def _advance(self, hold: Hold | None, cut: set[str]) -> None:
        """One control period."""
        at_rest = self._joints is None or not any(joint.velocity for joint in self._joints)
        if at_rest and self._new_limits is not None:
            self._apply_new_limits()
        if at_rest and hold is not None and hold.cause is Cause.OTHER_COMMANDER:
            # To repeat the posture would pull the head back from where the other turns it.
            self._joints = None
        if at_rest and hold is None and not self._engaged:
            self._start()
        if self._joints is None:
            return
        follow = self._engaged or (hold is not None and hold.cause is Cause.STALLED)
        if not follow or self._new_limits is not None:
            for joint in self._joints:
                joint.brake()
            return
        for joint, target in zip(self._joints, self.limits.reachable(self._target), strict=True):
            if limit := joint.approach(float(target)):
                cut.add(limit)

    def _start(self) -> None:
        assert self._measured is not None, 'the guard holds until joint states come'
        self._joints = self._profiles(self._measured)
        self._target = self._measured
        self._stall_watch.restart()
        self._engaged = True

    def _apply_new_limits(self) -> None:
        assert self._new_limits is not None
        self._limits_config, self._new_limits = self._new_limits, None
        self.limits = JointLimits(self._limits_config)
        if self._joints is not None:
            self._joints = self._profiles([joint.position for joint in self._joints])

    def _profiles(self, posture: ArrayLike) -> list[MotionProfile]:
        c = self._limits_config
        return [
            MotionProfile(
                self._period_s, c.max_speed_rad_s, c.max_acceleration_rad_s2, float(position)
            )
            for position in np.asarray(posture)
        ]

    def _enter_hold(self, hold: Hold) -> None:
        if self._engaged and hold.cause is Cause.STALLED and self._measured is not None:
            # Do not push against what blocks the joint.
            self._target = self._measured
        if self._engaged and self.config.latch_faults and hold.cause is not Cause.DISABLED:
            self._latched = replace(hold, text=f'{hold.text}; latched until gate/enable is called')
        self._engaged = False

    def _find_hold(self) -> Hold | None:
        c, now_s = self.config, self._now_s
        if self.other_commander:
            return Hold(Cause.OTHER_COMMANDER, self.other_commander)
        if not self._enabled:
            return Hold(Cause.DISABLED, 'disabled')
        if self._latched is not None:
            return self._latched
        if self.blocked:
            return Hold(Cause.BLOCKED, self.blocked)
        if self._measured is None:
            return Hold(Cause.WAITING, 'no joint state yet')
        if math.isinf(self._complete_s):
            return Hold(Cause.WAITING, 'no complete image yet')
        # A stamp ahead of the clock is as wrong as an old one: its age cannot be known.
        for cause, stamp_s, what in (
            (Cause.STALE_IMAGE, self._image_s, 'image'),
            (Cause.STALE_JOINTS, self._measured_s, 'joint state'),
        ):
            age_s = now_s - stamp_s
            if age_s < -c.stale_after_s:
                return Hold(cause, f'the newest {what} is stamped ahead of the clock')
            if not age_s <= c.stale_after_s:
                return Hold(cause, f'the newest {what} is older than {c.stale_after_s:g} s')
        if not now_s - self._complete_s <= c.hold_after_s:
            return Hold(Cause.SILENT, f'no complete image for {c.hold_after_s:g} s')
        if now_s < self._stalled_until_s or self._is_stalled():
            text = f'a joint does not follow its command within {c.stall_error_rad:g} rad'
            return Hold(Cause.STALLED, text)
        if not (self._engaged or self.limits.excess_rad(self._measured) <= c.outside_rad):
            text = f'the head stands more than {c.outside_rad:g} rad outside its limits'
            return Hold(Cause.OUTSIDE, f'{text}: {self._measured[0]:.3g}, {self._measured[1]:.3g}')
        return None

    def _is_stalled(self) -> bool:
        if not self._engaged or self._joints is None or self._measured is None:
            return False
        command = np.array([joint.position for joint in self._joints])
        c = self.config
        if not self._stall_watch.is_stalled(
            command, self._measured, self._measured_s, c.stall_error_rad, c.stall_after_s
        ):
            return False
        self._stalled_until_s = self._now_s + c.retry_after_s
        return True
