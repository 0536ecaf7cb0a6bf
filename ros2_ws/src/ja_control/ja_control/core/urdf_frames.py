"""Where the links of a robot description (URDF) are, from the positions of its joints."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ja_control.core.urdf import link_of, parse_urdf, read_number, read_vector

_TURNING, _SLIDING = ('revolute', 'continuous'), ('prismatic',)
_UNIT_WITHIN = 1e-6


class Pose(NamedTuple):
    """Where one frame is in another: `point in the other = rotation @ point + position`."""

    rotation: NDArray[np.float64]
    position: NDArray[np.float64]

    def after(self, inner: 'Pose') -> 'Pose':
        """Return where a frame is in the outer frame that is at `inner` in this one."""
        return Pose(self.rotation @ inner.rotation, self.rotation @ inner.position + self.position)

    def inverse(self) -> 'Pose':
        """Return where the other frame is in this one."""
        return Pose(self.rotation.T, -self.rotation.T @ self.position)


STANDING = Pose(np.eye(3), np.zeros(3))


class Mimic(NamedTuple):
    """The joint that another one follows: position = multiplier * its position + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class FrameJoint:
    """One joint: where the frame of its child link is in that of its parent link."""

    name: str
    parent: str
    child: str
    kind: str
    origin: Pose
    axis: NDArray[np.float64]
    mimic: Mimic | None

    @property
    def is_fixed(self) -> bool:
        """Return whether the child never moves in the parent."""
        return self.kind == 'fixed'

    def pose(self, position: float = 0.0) -> Pose:
        """Return where the child is in the parent at a position [rad, or m where it slides]."""
        if self.kind in _TURNING:
            turn = Rotation.from_rotvec(position * self.axis).as_matrix()
            return self.origin.after(Pose(turn, np.zeros(3)))
        if self.kind in _SLIDING:
            return self.origin.after(Pose(np.eye(3), position * self.axis))
        return self.origin


class FrameTree:
    """The links and joints of a robot description, checked to be a tree."""

    def __init__(self, urdf: str) -> None:
        """Read a URDF. Raises ValueError with what is wrong, and what to do."""
        robot = parse_urdf(urdf)
        self.links = tuple(link.get('name', '') for link in robot.findall('link'))
        self.joints = tuple(_read_joint(each) for each in robot.findall('joint'))
        self._by_child = {joint.child: joint for joint in self.joints}
        self._by_name = {joint.name: joint for joint in self.joints}
        self.root = self._find_root()
        for joint in self.joints:
            self._source_of(joint)

    def moving_joints(self, names: Mapping[str, float]) -> Iterator[FrameJoint]:
        """Yield the joints that are named, or that follow one of those."""
        for joint in self.joints:
            if not joint.is_fixed and self._source_of(joint)[0] in names:
                yield joint

    def joint_pose(self, joint: FrameJoint, positions: Mapping[str, float]) -> Pose:
        """Return where a joint's child is in its parent. Raises KeyError if it is not known."""
        if joint.is_fixed:
            return joint.pose()
        source, multiplier, offset = self._source_of(joint)
        return joint.pose(multiplier * positions[source] + offset)

    def pose(self, link: str, base: str, positions: Mapping[str, float]) -> Pose:
        """Return where a link is in another one.

        Raises ValueError for a link that does not exist, KeyError for a joint that is not known.
        """
        of_link, of_base = self._apart(link, base)
        return self._through(of_base, positions).inverse().after(self._through(of_link, positions))

    def joints_between(self, link: str, base: str) -> set[str]:
        """Return the names of the joints whose positions `pose` needs; ValueError as there."""
        between = [joint for chain in self._apart(link, base) for joint in chain]
        return {self._source_of(joint)[0] for joint in between if not joint.is_fixed}

    def _apart(self, link: str, base: str) -> tuple[list[FrameJoint], list[FrameJoint]]:
        """Return the joints from two links to the nearest link from which both hang."""
        of_link, of_base = list(self._chain(link)), list(self._chain(base))
        while of_link and of_base and of_link[-1] is of_base[-1]:
            of_link.pop()
            of_base.pop()
        return of_link, of_base

    def _through(self, chain: list[FrameJoint], positions: Mapping[str, float]) -> Pose:
        """Return where the first link of a chain of joints is in the last one."""
        pose = STANDING
        for joint in chain:
            pose = self.joint_pose(joint, positions).after(pose)
        return pose

    def _chain(self, link: str) -> Iterator[FrameJoint]:
        """Yield the joints from a link to the root."""
        if link not in self.links:
            raise ValueError(
                f'the robot description has no link {link!r}; it has {sorted(self.links)}: set '
                'base_frame and camera_frame to two of them'
            )
        while link != self.root:
            joint = self._by_child[link]
            yield joint
            link = joint.parent

    def _source_of(self, joint: FrameJoint) -> Mimic:
        """Return the joint in joint_states from which a joint's position follows, and how."""
        source = Mimic(joint.name, 1.0, 0.0)
        for _ in self.joints:
            if joint.mimic is None:
                return source
            name, multiplier, offset = joint.mimic
            if name not in self._by_name:
                raise ValueError(
                    f'joint {joint.name} of the robot description follows {name!r} (mimic), '
                    'which it does not have: name one of its joints'
                )
            gain = source.multiplier
            source = Mimic(name, gain * multiplier, gain * offset + source.offset)
            joint = self._by_name[name]
        if joint.mimic is not None:
            raise ValueError(
                f'joint {joint.name} of the robot description follows itself (mimic): '
                'remove one <mimic>'
            )
        return source

    def _find_root(self) -> str:
        """Return the one link without a parent, once all others hang on it."""
        if not self.links:
            raise ValueError('the robot description has no <link>: it describes no frames')
        _refuse_doubles('links', self.links)
        _refuse_doubles('joints', [joint.name for joint in self.joints])
        for joint in self.joints:
            for role, link in (('parent', joint.parent), ('child', joint.child)):
                if link not in self.links:
                    raise ValueError(
                        f'joint {joint.name} of the robot description has the {role} {link!r}, '
                        f'which is no link of it: it has {sorted(self.links)}'
                    )
        children = [joint.child for joint in self.joints]
        for link in sorted({each for each in children if children.count(each) > 1}):
            parents = [joint.parent for joint in self.joints if joint.child == link]
            raise ValueError(
                f'link {link} of the robot description hangs on {parents}: '
                'remove all joints to it but one'
            )
        roots = [link for link in self.links if link not in children]
        if len(roots) != 1:
            raise ValueError(
                f'the robot description has {len(roots)} links without a parent {roots}, not '
                'one: a URDF is a tree, connect them with fixed joints'
                if roots
                else 'the joints of the robot description form a loop'
            )
        hanging = {roots[0]}
        for _ in self.joints:
            hanging |= {joint.child for joint in self.joints if joint.parent in hanging}
        if hanging != set(self.links):
            raise ValueError('the joints of the robot description form a loop')
        return roots[0]


def _read_joint(joint: ElementTree.Element) -> FrameJoint:
    name, kind = joint.get('name', ''), joint.get('type', '')
    if not name:
        raise ValueError('a joint of the robot description has no name: give it one')
    if kind not in ('fixed', *_TURNING, *_SLIDING):
        raise ValueError(
            f'joint {name} of the robot description is {kind or "without a type"}: joint_states '
            'can hold revolute, continuous, prismatic and fixed joints only'
        )
    axis = read_vector(joint.find('axis'), 'xyz', '1 0 0')
    length = float(np.linalg.norm(axis))
    if kind != 'fixed' and length < _UNIT_WITHIN:
        raise ValueError(
            f'the axis of joint {name} of the robot description is 0 0 0: state its direction'
        )
    origin = joint.find('origin')
    rotation = Rotation.from_euler('xyz', read_vector(origin, 'rpy', '0 0 0')).as_matrix()
    return FrameJoint(
        name,
        link_of(joint, 'parent'),
        link_of(joint, 'child'),
        kind,
        Pose(rotation, read_vector(origin, 'xyz', '0 0 0')),
        axis / max(length, _UNIT_WITHIN),
        None if kind == 'fixed' else _read_mimic(joint, name),
    )


def _read_mimic(joint: ElementTree.Element, name: str) -> Mimic | None:
    mimic = joint.find('mimic')
    if mimic is None:
        return None
    multiplier, offset = (
        read_number(
            mimic.get(key, default), f'joint {name} of the robot description: the {key} of <mimic>'
        )
        for key, default in (('multiplier', '1'), ('offset', '0'))
    )
    return Mimic(mimic.get('joint', ''), multiplier, offset)


def _refuse_doubles(what: str, names: list[str] | tuple[str, ...]) -> None:
    double = sorted({name for name in names if names.count(name) > 1})
    if double:
        raise ValueError(f'the robot description has several {what} {double}: rename all but one')
