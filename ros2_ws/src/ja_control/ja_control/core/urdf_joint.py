"""All limits that a robot description states of one joint, each with the place that states it.

They stand in `<limit>`, in `<safety_controller>` (soft limits), and in the `<command_interface>`
and `<state_interface>` elements of ros2_control. The narrowest ones hold.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ja_control.core.urdf import axis_in_root, find_joint, parse_urdf, read_number

_RATES = ('velocity', 'acceleration')
_LARGEST_RAD = 6.3
"""2 pi, rounded up: an angle beyond it is probably in degrees."""
_UNLIMITED = 1000.0
"""Numbers from here on, as 1e16, are a way to write that there is no limit."""


class Bound(NamedTuple):
    """One limit [rad, rad/s or rad/s^2], and what states it."""

    value: float
    source: str


@dataclass(frozen=True)
class UrdfJoint:
    """One joint: its narrowest limits as the rig counts, and its axis (3,) in the root's frame.

    Infinite limits stand for those that are not stated. `notes` are what a person should know.
    """

    low: Bound
    high: Bound
    max_speed: Bound
    max_acceleration: Bound
    axis: NDArray[np.float64]
    notes: tuple[str, ...] = ()


def read_joint(urdf: str, name: str) -> UrdfJoint:
    """Return one joint of a URDF, all joints at zero.

    Raises ValueError with what is missing or wrong.
    """
    robot = parse_urdf(urdf)
    joint = find_joint(robot, name)
    kind = joint.get('type')
    if kind not in ('revolute', 'continuous'):
        raise ValueError(f'joint {name} of the robot description is {kind}, not revolute')
    controls = [
        control
        for system in robot.findall('ros2_control')
        for control in system.findall('joint')
        if control.get('name') == name
    ]
    _refuse_mimic(joint, controls, name)
    limits = _Limits(name)
    limits.read_limit(joint.find('limit'), kind)
    limits.read_soft_limits(joint.find('safety_controller'))
    for control in controls:
        limits.read_interfaces(control)
    return limits.narrowest(axis_in_root(robot, joint))


def _refuse_mimic(
    joint: ElementTree.Element, controls: list[ElementTree.Element], name: str
) -> None:
    followed = [mimic.get('joint', '') for mimic in joint.findall('mimic')]
    for control in controls:
        if control.get('mimic', '').lower() == 'true':
            followed.append('')
        followed += [text for key, text in _parameters(control) if key == 'mimic']
    if followed:
        other = next(filter(None, followed), 'another joint')
        raise ValueError(
            f'joint {name} follows {other} (mimic), so it cannot be commanded by itself: name the '
            'joint that has a motor in pan_joint or tilt_joint, or remove <mimic>'
        )


def _parameters(element: ElementTree.Element) -> Iterator[tuple[str, str]]:
    for parameter in element.findall('param'):
        yield parameter.get('name', ''), (parameter.text or '').strip()


class _Limits:
    """Collects the limits of one joint."""

    def __init__(self, joint: str) -> None:
        self._joint = joint
        self._lows: list[Bound] = []
        self._highs: list[Bound] = []
        self._speeds: list[Bound] = []
        self._accelerations: list[Bound] = []
        self._notes: list[str] = []

    def read_limit(self, limit: ElementTree.Element | None, kind: str) -> None:
        stated = {} if limit is None else limit.attrib
        lower, upper = stated.get('lower'), stated.get('upper')
        if kind == 'revolute':
            if lower is None and upper is None:
                what = 'no <limit>' if limit is None else 'a <limit> without lower and upper'
                raise ValueError(
                    f'joint {self._joint} of the robot description is revolute and has {what}: '
                    'state lower and upper [rad], or type="continuous" where nothing stops it'
                )
            lower, upper = lower or '0', upper or '0'  # as the URDF specification has it
        if not self._read_range('<limit>', lower, upper) and kind == 'revolute':
            raise ValueError(
                f'joint {self._joint} cannot move from 0 to 0 (<limit>): where an exporter filled '
                'in zeros, state the true lower and upper [rad]'
            )
        self._read_rate(self._speeds, '<limit>', 'velocity', stated.get('velocity'))
        for name in ('acceleration', 'deceleration'):
            self._read_rate(self._accelerations, '<limit>', name, stated.get(name))
        if 'jerk' in stated:
            self._notes.append(f'joint {self._joint}: jerk of <limit> is not obeyed')

    def read_soft_limits(self, soft: ElementTree.Element | None) -> None:
        if soft is not None:
            texts = (soft.get('soft_lower_limit'), soft.get('soft_upper_limit'))
            self._read_range('<safety_controller>', *texts)

    def read_interfaces(self, control: ElementTree.Element) -> None:
        for kind in ('command_interface', 'state_interface'):
            for interface in control.findall(kind):
                stated = dict(_parameters(interface))
                low, high = stated.get('min'), stated.get('max')
                # A reference of a chained controller has a prefix: `pan_controller/position`.
                quantity = interface.get('name', '').rpartition('/')[2]
                if quantity == 'position':
                    self._read_range(f'<{kind}>', low, high)
                elif quantity in _RATES:
                    rates = self._speeds if quantity == 'velocity' else self._accelerations
                    for text in (low, high):
                        self._read_rate(rates, f'<{kind}>', quantity, text)

    def narrowest(self, axis: NDArray[np.float64]) -> UrdfJoint:
        """Return the joint with the narrowest of all limits that were stated."""
        nothing = Bound(math.inf, 'nothing')
        low = max([*self._lows, Bound(-math.inf, 'nothing')])
        high = min([*self._highs, nothing])
        if not low.value < high.value:
            raise ValueError(
                f'joint {self._joint} of the robot description cannot move from {low.value:g} '
                f'({low.source}) to {high.value:g} ({high.source})'
            )
        return UrdfJoint(
            low,
            high,
            min([*self._speeds, nothing]),
            min([*self._accelerations, nothing]),
            axis,
            tuple(self._notes),
        )

    def _bound(self, value: float, source: str) -> Bound:
        return Bound(value, f'{source} of {self._joint}')

    def _read_range(self, source: str, lower: str | None, upper: str | None) -> bool:
        """Keep both ends of a range; return False for zeros, which a generator fills in."""
        low = self._read_angle(source, 'lower', lower)
        high = self._read_angle(source, 'upper', upper)
        if low == high == 0.0:
            self._notes.append(f'joint {self._joint}: {source} from 0 to 0 is taken as not stated')
            return False
        if low is not None:
            self._lows.append(self._bound(low, source))
        if high is not None:
            self._highs.append(self._bound(high, source))
        return True

    def _read_angle(self, source: str, end: str, text: str | None) -> float | None:
        if text is None:
            return None
        angle = read_number(text, f'joint {self._joint}: the {end} limit of {source}')
        if abs(angle) >= _UNLIMITED:
            return None
        if abs(angle) > _LARGEST_RAD:
            raise ValueError(
                f'joint {self._joint}: the {end} limit {angle:g} of {source} is more than a turn: '
                'a URDF counts in radians; if it is in degrees, convert it'
            )
        return angle

    def _read_rate(self, rates: list[Bound], source: str, name: str, text: str | None) -> None:
        if text is None:
            return
        rate = abs(read_number(text, f'joint {self._joint}: {name} of {source}'))
        if rate > 0.0:
            rates.append(self._bound(rate, source))
        else:
            # The attribute is required, and 0 is what people write who do not know it.
            self._notes.append(f'joint {self._joint}: {name} 0 of {source} is taken as not stated')
