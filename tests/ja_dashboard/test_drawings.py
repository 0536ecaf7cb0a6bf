"""The drawings of the page show objects where they are."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from ja_common.core.detection import Detection, Kind
from ja_dashboard.core.drawings import from_above, postures
from ja_dashboard.core.view_model import SceneView, TruthView

LEFT_DOWN = (0.5, 0.2)  # pan to the left, tilt downward


def scene(**changes):
    half = np.radians([18.0, 13.5])
    limits = np.radians([[-60.0, -35.0], [60.0, 35.0]])
    return SceneView(tuple(half), limits[0], limits[1], **changes)


def drawn(svg, kind):
    """Return the attributes of the elements of a class."""
    tree = ElementTree.fromstring(svg)
    return [e.attrib for e in tree.iter() if kind in e.attrib.get('class', '').split()]


def seen(kind=Kind.OBJECT):
    return scene(
        posture=np.array(LEFT_DOWN),
        detections=[Detection(kind, 0.0, 0.0, 160.0, 120.0, 20.0, 20.0, 0.5, track_id=7)],
        directions=np.array([LEFT_DOWN]),
    )


def place(attributes):
    return float(attributes['cx']), float(attributes['cy'])


@pytest.mark.parametrize(('kind', 'name'), [(Kind.OBJECT, 'object'), (Kind.FACE, 'face')])
def test_object_to_the_left_is_drawn_to_the_left(kind, name):
    x, y = place(*drawn(from_above(seen(kind)), name))
    assert x == pytest.approx(-np.cos(0.2) * np.sin(0.5), abs=1e-3)
    assert y == pytest.approx(-np.cos(0.2) * np.cos(0.5), abs=1e-3)
    x, y = place(*drawn(postures(seen(kind)), name))
    assert (x, y) == pytest.approx((-np.degrees(0.5), np.degrees(0.2)), abs=0.1)


def test_the_field_of_view_lies_around_the_posture():
    [area] = drawn(postures(seen()), 'area')
    assert float(area['width']) == pytest.approx(36.0)
    centre = float(area['x']) + float(area['width']) / 2
    assert centre == pytest.approx(-np.degrees(0.5), abs=0.1)


def test_the_limits_frame_the_postures_left_to_right():
    frame = drawn(postures(scene()), 'limit')[0]
    assert float(frame['x']) == pytest.approx(-60.0)
    assert float(frame['width']) == pytest.approx(120.0)


def test_the_command_is_a_cross_apart_from_the_measured_posture():
    lines = drawn(postures(scene(command=np.array([-0.5, 0.0]))), 'command')
    assert len(lines) == 2
    assert float(lines[1]['x1']) == pytest.approx(np.degrees(0.5), abs=0.1)


def test_the_belief_is_a_cloud_whose_heaviest_point_is_opaque():
    cloud = np.array([[0.1, 0.0, 1.0], [0.2, 0.0, 4.0]])
    for draw in (from_above, postures):
        points = drawn(draw(scene(belief=cloud)), 'belief')
        assert [p['fill-opacity'] for p in points] == ['0.25', '1.00']


def test_the_truth_marks_the_attended_object():
    places = np.array([[0.8, 0.3, 0.0], [0.7, -0.2, 0.1]])
    truth = TruthView(places, np.array([[0.36, 0.0], [-0.28, -0.14]]), attended=1)
    for draw in (from_above, postures):
        assert len(drawn(draw(scene(truth=truth)), 'truth')) == 2
        [attended] = drawn(draw(scene(truth=truth)), 'attended')
        assert place(attended)[0] > 0, 'to the right'
        assert not drawn(draw(scene()), 'truth')
