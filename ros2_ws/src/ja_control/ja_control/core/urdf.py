"""A robot description (URDF) as elements, with errors that name what is wrong and what to do."""

import math
import xml.etree.ElementTree as ElementTree

import numpy as np
from numpy.typing import NDArray

LARGEST_URDF = 2**24
"""Characters of a robot description that is read; those with meshes have some thousand."""

_RUN_XACRO = 'run xacro on the file, and publish what it prints'


class _WithoutDoctype(ElementTree.TreeBuilder):
    """A builder that refuses a document type: its entities can expand to more than the memory."""

    def doctype(self, name: str, _pubid: str | None, _system: str | None) -> None:
        raise ValueError(f'the robot description has a DOCTYPE ({name[:50]}): remove it')


def parse_urdf(urdf: str) -> ElementTree.Element:
    """Return the root element of a URDF.

    Raises ValueError for text that is too long, no XML, no URDF, or xacro that was not expanded.
    """
    if len(urdf) > LARGEST_URDF:
        raise ValueError(f'the robot description is longer than {LARGEST_URDF} characters')
    try:
        robot = ElementTree.fromstring(urdf, ElementTree.XMLParser(target=_WithoutDoctype()))
    except ElementTree.ParseError as error:
        raise ValueError(f'the robot description is no XML: {error}') from None
    if robot.tag != 'robot':
        raise ValueError(f'the robot description is no URDF: it is a <{robot.tag[:50]}>')
    for element in robot.iter():
        # The tag of a comment is a function.
        if isinstance(element.tag, str) and element.tag.startswith('{') and 'xacro' in element.tag:
            name = element.tag.rpartition('}')[2]
            raise ValueError(
                f'the robot description is xacro that was not expanded (<xacro:{name[:50]}>): '
                f'{_RUN_XACRO}'
            )
    return robot


def find_joint(robot: ElementTree.Element, name: str) -> ElementTree.Element:
    """Return the joint of this name. Raises ValueError where there is none, or several."""
    found = [joint for joint in robot.findall('joint') if joint.get('name') == name]
    if len(found) > 1:
        raise ValueError(
            f'the robot description has {len(found)} joints {name!r}: rename all but one'
        )
    if not found:
        names = sorted(joint.get('name', '') for joint in robot.findall('joint'))
        for other in names:
            refuse_xacro(other, 'the name of a joint of the robot description')
        raise ValueError(
            f'the robot description has no joint {name!r}; it has {names}: '
            'set pan_joint and tilt_joint to two of them'
        )
    return found[0]


def axis_in_root(robot: ElementTree.Element, joint: ElementTree.Element) -> NDArray[np.float64]:
    """Return the axis (3,) of a joint, of length 1, in the root link's frame, all joints at zero.

    Raises ValueError for an axis or an origin that is not 3 numbers, or joints that form a loop.
    """
    axis = read_vector(joint.find('axis'), 'xyz', '1 0 0')
    turned = _rotation_to_root(joint, robot.findall('joint')) @ axis
    return turned / max(float(np.linalg.norm(turned)), 1e-12)


def read_number(text: str, what: str) -> float:
    """Return the finite number that a text holds; `what` it is, for the ValueError."""
    refuse_xacro(text, what)
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f'{what} is no number: "{text[:40]}"')
    return number


def refuse_xacro(text: str, what: str) -> None:
    """Raise ValueError for a text with an expression that xacro has not replaced."""
    if '${' in text or '$(' in text:
        raise ValueError(f'{what} is "{text[:40]}", which xacro has not expanded: {_RUN_XACRO}')


def _rotation_to_root(
    joint: ElementTree.Element, joints: list[ElementTree.Element]
) -> NDArray[np.float64]:
    """Rotation (3, 3) from the joint's frame to the root link's."""
    by_child = {link_of(j, 'child'): j for j in joints}
    rotation = np.eye(3)
    current: ElementTree.Element | None = joint
    for _ in range(len(joints)):
        if current is None:
            return rotation
        rotation = _rpy(read_vector(current.find('origin'), 'rpy', '0 0 0')) @ rotation
        current = by_child.get(link_of(current, 'parent'))
    if current is not None:
        raise ValueError('the joints of the robot description form a loop')
    return rotation


def link_of(joint: ElementTree.Element, role: str) -> str:
    """Return the link that a joint names as its parent or child (`role`); '' without one."""
    element = joint.find(role)
    return '' if element is None else element.get('link', '')


def _rpy(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation (3, 3) about the fixed axes x, y, z, as in URDF."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def read_vector(
    element: ElementTree.Element | None, attribute: str, default: str
) -> NDArray[np.float64]:
    """Return the 3 numbers (3,) of an attribute, those of `default` where it is not stated.

    Raises ValueError for anything else.
    """
    text = default if element is None else element.get(attribute, default)
    what = f'{attribute}="{text[:40]}" of the robot description'
    refuse_xacro(text, what)
    try:
        numbers = np.array([float(word) for word in text.split()])
    except ValueError:
        numbers = np.empty(0)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f'{what} is not 3 numbers')
    return numbers
