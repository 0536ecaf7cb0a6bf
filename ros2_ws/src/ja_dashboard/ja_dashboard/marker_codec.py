"""Shapes on the wire: visualization_msgs/MarkerArray, as RViz and Foxglove show it."""

from collections import Counter
from collections.abc import Sequence

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from ja_dashboard.core.markers import Form, Shape

_TYPES = {
    Form.ARROW: Marker.ARROW,
    Form.LINE: Marker.LINE_STRIP,
    Form.SEGMENTS: Marker.LINE_LIST,
    Form.POINTS: Marker.POINTS,
    Form.TEXT: Marker.TEXT_VIEW_FACING,
}
# Widths of the head of an arrow, and its length, in widths of its shaft.
_ARROW_HEAD = (2.5, 5.0)


def encode_markers(header: Header, shapes: Sequence[Shape]) -> MarkerArray:
    """Return a message that replaces all that earlier ones on the topic have drawn."""
    deletion = Marker(header=header, action=Marker.DELETEALL)
    count: Counter[str] = Counter()
    markers = [deletion]
    for shape in shapes:
        markers.append(_marker(header, shape, count[shape.group]))
        count[shape.group] += 1
    return MarkerArray(markers=markers)


def _marker(header: Header, shape: Shape, number: int) -> Marker:
    marker = Marker(
        header=header,
        ns=shape.group,
        id=number,
        type=_TYPES[shape.form],
        action=Marker.ADD,
        scale=_scale(shape),
        color=_colour(shape, 1.0),
        lifetime=Duration(),
        text=shape.text,
    )
    marker.pose.orientation.w = 1.0  # RViz warns of a quaternion of zeros
    points = [Point(x=x, y=y, z=z) for x, y, z in shape.points.tolist()]
    if shape.form is Form.TEXT:
        marker.pose.position = points[0]
        return marker
    marker.points = points
    if shape.opacities is not None:
        marker.colors = [_colour(shape, opacity) for opacity in shape.opacities.tolist()]
    return marker


def _scale(shape: Shape) -> Vector3:
    size_m = shape.size_m
    if shape.form is Form.ARROW:
        wide, long = _ARROW_HEAD
        return Vector3(x=size_m, y=wide * size_m, z=long * size_m)
    if shape.form is Form.TEXT:
        return Vector3(z=size_m)
    return Vector3(x=size_m, y=size_m if shape.form is Form.POINTS else 0.0)


def _colour(shape: Shape, opacity: float) -> ColorRGBA:
    red, green, blue, alpha = shape.colour
    return ColorRGBA(r=red, g=green, b=blue, a=alpha * opacity)
