"""The shapes of the markers: where they stand, what they state, and what a message deletes."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from visualization_msgs.msg import Marker

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind
from ja_common.core.fixation import WIDTH_SIXTH
from ja_common.core.geometry import (
    angle_between,
    directions_of_vectors,
    rays_of_directions,
    vectors_of_directions,
)
from ja_common.topics import TOPICS
from ja_dashboard.core.markers import HeadScene, label_of, shapes_of
from ja_dashboard.marker_codec import encode_markers
from ja_dashboard.markers_node import MarkersConfig
from node_bench import header

VIEWERS = Path(__file__).parents[2] / 'docs' / 'viewers'
POSTURE = np.array([0.3, -0.2])
DISTANCE_M = 2.0


def detection(direction, kind=Kind.OBJECT, **more):
    x, y = rays_of_directions(POSTURE, direction)
    return Detection(kind, x, y, 100.0, 60.0, 20.0, 24.0, 0.87, **more)


def shapes(**scene):
    found = {}
    for shape in shapes_of(HeadScene(POSTURE, **scene), DISTANCE_M, WIDTH_SIXTH):
        found.setdefault(shape.group, []).append(shape)
    return found


def test_the_ray_of_an_object_ends_at_its_direction_and_at_the_nominal_distance():
    direction = (0.45, 0.1)
    [ray] = shapes(detections=[detection(direction)])['object_rays']
    assert ray.points[0] == pytest.approx([0, 0, 0])
    assert ray.points[1] == pytest.approx(DISTANCE_M * vectors_of_directions(direction))


def test_straight_ahead_is_x_and_left_is_y_of_the_base_frame():
    [ahead] = shapes(command=np.zeros(2))['commanded']
    assert ahead.points[1] == pytest.approx([DISTANCE_M, 0, 0])
    [left] = shapes(command=np.array([math.pi / 2, 0.0]))['commanded']
    assert left.points[1] == pytest.approx([0, DISTANCE_M, 0])


def test_an_object_of_known_range_stands_there():
    [ray] = shapes(detections=[detection((0.2, 0.0), range_m=1.31)])['object_rays']
    assert np.linalg.norm(ray.points[1]) == pytest.approx(1.31)


@pytest.mark.parametrize(
    ('kind', 'more', 'text'),
    [
        (Kind.OBJECT, {'track_id': 3}, 'object 3 0.87'),
        (Kind.OBJECT, {}, 'object 0.87'),
        (Kind.OBJECT, {'track_id': 3, 'range_m': 1.314}, 'object 3 0.87, 1.31 m'),
        (Kind.FACE, {'attended': True}, 'face 0.87, attended'),
    ],
)
def test_a_label_states_what_it_is(kind, more, text):
    seen = detection((0.2, 0.0), kind, **more)
    assert label_of(seen) == text
    group = 'face_labels' if kind is Kind.FACE else 'object_labels'
    [label] = shapes(detections=[seen])[group]
    assert label.text == text


def test_the_circle_has_the_radius_d_th_around_the_optical_axis():
    [circle] = shapes()['fixation_circle']
    assert np.linalg.norm(circle.points, axis=1) == pytest.approx(DISTANCE_M)
    angles = angle_between(directions_of_vectors(circle.points), POSTURE)
    assert angles == pytest.approx(WIDTH_SIXTH)
    assert circle.points[0] == pytest.approx(circle.points[-1]), 'closed'


def test_the_field_of_view_spans_the_image():
    camera = CameraModel.from_field_of_view(320, 240, math.radians(36))
    edge, sides = shapes(camera=camera)['field_of_view']
    rays = rays_of_directions(POSTURE, directions_of_vectors(edge.points))
    half = math.tan(math.radians(18))
    assert np.abs(rays).max(axis=0) == pytest.approx([half, 0.75 * half])
    assert len(sides.points) == 8
    assert 'field_of_view' not in shapes(), 'no calibration'


def test_a_camera_without_rays_is_not_drawn():
    camera = CameraModel(320, 240, math.nan, 300.0, 160.0, 120.0)
    assert set(shapes(camera=camera)) == {'fixation_circle'}


def test_the_gaze_at_the_camera_points_to_the_origin_and_turns_to_the_left():
    face = detection((0.3, -0.2), Kind.FACE, gaze_read=True, range_m=1.0)
    [gaze] = shapes(detections=[face], gaze=np.zeros(2))['gaze']
    start, end = gaze.points
    assert (end - start) / DISTANCE_M == pytest.approx(-start)
    [left] = shapes(detections=[face], gaze=np.array([0.4, 0.0]))['gaze']
    start, end = left.points
    to_the_left = np.array([-math.sin(0.3), math.cos(0.3), 0.0])
    assert (end - start) @ to_the_left / DISTANCE_M == pytest.approx(math.sin(0.4))
    [down] = shapes(detections=[face], gaze=np.array([0.0, 0.4]))['gaze']
    assert down.points[1][2] < gaze.points[1][2]
    assert 'gaze' not in shapes(detections=[face._replace(gaze_read=False)], gaze=np.zeros(2))


def test_the_attended_direction_is_the_fixation_or_the_face_in_the_centre():
    face = detection((0.31, -0.2), Kind.FACE, attended=True)
    [attended] = shapes(detections=[face])['attended']
    assert attended.points[1] == pytest.approx(DISTANCE_M * vectors_of_directions((0.31, -0.2)))
    [attended] = shapes(detections=[face], fixation=np.array([0.1, 0.1]))['attended']
    assert attended.points[1] == pytest.approx(DISTANCE_M * vectors_of_directions((0.1, 0.1)))
    assert 'attended' not in shapes(detections=[face._replace(attended=False)])


def test_the_belief_is_points_whose_opacity_is_their_weight():
    belief = np.array([[0.1, 0.0, 0.25], [0.2, 0.1, 0.5]])
    [points] = shapes(belief=belief)['belief']
    assert points.points == pytest.approx(DISTANCE_M * vectors_of_directions(belief[:, :2]))
    assert points.opacities == pytest.approx([0.5, 1.0])


def test_a_message_deletes_what_was_drawn_before():
    seen = [detection((0.2, 0.0), track_id=1), detection((0.4, 0.0), track_id=2)]
    for count in (2, 1, 0):
        found = shapes_of(HeadScene(POSTURE, seen[:count]), DISTANCE_M, WIDTH_SIXTH)
        message = encode_markers(header(7, 'base_link'), found)
        first, *drawn = message.markers
        assert first.action == Marker.DELETEALL
        assert sum(each.ns == 'object_rays' for each in drawn) == count
        names = [(each.ns, each.id) for each in drawn]
        assert len(set(names)) == len(names)
        assert {each.action for each in drawn} == {Marker.ADD}
        assert {each.header.frame_id for each in message.markers} == {'base_link'}


def test_a_marker_has_what_its_type_needs():
    camera = CameraModel.from_field_of_view(320, 240, math.radians(36))
    scene = HeadScene(POSTURE, [detection((0.2, 0.0))], camera, belief=np.array([[0.1, 0.0, 0.5]]))
    markers = encode_markers(header(7), shapes_of(scene, DISTANCE_M, WIDTH_SIXTH)).markers
    by_type = {each.type: each for each in markers[1:]}
    assert by_type[Marker.TEXT_VIEW_FACING].scale.z > 0
    assert by_type[Marker.TEXT_VIEW_FACING].text == 'object 0.87'
    assert len(by_type[Marker.ARROW].points) == 2
    assert len(by_type[Marker.LINE_LIST].points) % 2 == 0
    assert len(by_type[Marker.POINTS].points) == len(by_type[Marker.POINTS].colors) == 1
    assert all(each.scale.x > 0 for each in markers[1:] if each.type != Marker.TEXT_VIEW_FACING)
    assert all(each.pose.orientation.w == 1 and each.color.a > 0 for each in markers[1:])


def test_the_files_for_viewers_name_topics_of_the_graph():
    names = {topic.name for topic in TOPICS}
    rviz = yaml.safe_load((VIEWERS / 'head.rviz').read_text())['Visualization Manager']
    shown = {each['Topic']['Value'] for each in rviz['Displays'] if 'Topic' in each}
    assert {'markers', 'image_annotated'} == shown <= names
    assert rviz['Global Options']['Fixed Frame'] == MarkersConfig().base_frame
    layout = json.loads((VIEWERS / 'foxglove_layout.json').read_text())
    panels = layout['configById']
    assert {*panels['3D!head']['topics'], panels['Image!camera']['imageMode']['imageTopic']} == {
        f'/{name}' for name in shown
    }
    assert panels['3D!head']['followTf'] == MarkersConfig().base_frame
    assert panels.keys() == set(re.findall(r'\w+!\w+', json.dumps(layout['layout'])))
