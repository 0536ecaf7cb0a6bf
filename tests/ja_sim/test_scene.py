"""Scenes: the shipped ones load, and an error names the file and line."""

import os

import pytest

from ja_common.core.config import ConfigError
from ja_sim.core.scene import SceneError, load_scene, scene_names
from ja_sim.core.specs import HEAD_PRESETS, HeadSpec, ObjectsSpec


def test_every_shipped_scene_loads():
    assert {'bare_room', 'default', 'easy'} <= set(scene_names())
    for name in scene_names():
        assert load_scene(name).name == name


def test_default_is_the_geometry_of_the_figures():
    scene = load_scene('default')
    assert scene.caregiver.distance_m == 1.2
    assert scene.caregiver.head_share == (0.6, 0.9)
    assert scene.objects.pan_deg == (-40.0, 40.0)
    assert scene.objects.tilt_deg == (-15.0, 15.0)
    assert scene.objects.distance_m == (0.6, 1.0)
    assert (scene.objects.gap_to_face_deg, scene.objects.gap_deg) == (8.0, 5.0)
    assert scene.head == HEAD_PRESETS['ideal']
    assert (scene.senses.depth, scene.senses.second_camera) == ('none', False)


def test_easy_keeps_all_objects_in_the_first_view():
    scene = load_scene('easy')
    assert max(map(abs, scene.objects.pan_deg)) < scene.head.view_pan_deg
    assert max(map(abs, scene.objects.tilt_deg)) < scene.head.view_tilt_deg


def test_a_file_names_only_what_differs(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text('head:\n  preset: hobby_servo\n  backlash_deg: 2\nobjects:\n  count: 7\n')
    scene = load_scene(str(path))
    assert scene.name == 'mine'
    assert scene.objects == ObjectsSpec(count=7)
    assert scene.head.backlash_deg == 2
    assert scene.head.dead_time_s == HEAD_PRESETS['hobby_servo'].dead_time_s


@pytest.mark.parametrize(
    ('text', 'line', 'part'),
    [
        ('objects:\n  cout: 3', 2, "did you mean 'count'"),
        ('\nobjects:\n  count: 11', 3, 'outside the range 1 to 10'),
        ('objects:\n  count: 3.5', 2, 'int'),
        ('caregiver:\n  turn_s: .nan', 2, 'finite'),
        ('caregiver:\n  head_share: [0.9, 0.6]', 2, 'rising pair'),
        ('caregiver:\n  head_share: 0.9', 2, 'not a pair'),
        ('head: servo', 1, 'choose ideal, hobby_servo'),
        ('head: ideal\ncaregiver: anna', 2, 'expected a table'),
        ('room:\n  furnished: 3', 2, 'bool'),
        ('senses:\n  depth: yes', 2, 'str is needed'),
        ('senses:\n  depth: lidar', 2, 'none, sensor, exact'),
        ('senses:\n  baseline_m: 0', 2, 'outside the range'),
        ('senses:\n  disparity_noise_px: -1', 2, 'outside the range'),
        ('senses:\n  depth_range_m: [4, 0.3]', 2, 'rising pair'),
        ('senses:\n  second_kamera: true', 2, "did you mean 'second_camera'"),
        ('senses: depth', 1, 'expected a table'),
        ('head:\n  camera_latency_s: 0.1', 2, 'camera_rate_hz'),
        ('head: ideal\nobjects: [', 2, 'not YAML'),
    ],
)
def test_a_mistake_is_told_with_its_line(tmp_path, text, line, part):
    path = tmp_path / 'broken.yaml'
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load_scene(str(path))
    assert str(caught.value).startswith(f'{path}:{line}: ')
    assert part in str(caught.value)


def test_unknown_names_and_missing_files_are_told(tmp_path):
    with pytest.raises(SceneError, match='the package has bare_room, default, easy'):
        load_scene('defalt')
    with pytest.raises(SceneError, match='cannot be read'):
        load_scene(str(tmp_path / 'nowhere.yaml'))


def test_values_from_python_are_checked_too():
    with pytest.raises(ConfigError, match='backlash_deg'):
        HeadSpec(backlash_deg=-1.0)


@pytest.mark.parametrize(
    'text',
    [
        'a: &a [x]\nb: [*a, *a]',
        b'name: \xff',
        'name: \0',
        'objects: ' + '[' * 3000,
        'objects:\n  count: 3\n  count: 4',
        'objects:\n  count: ' + '9' * 5000,
        'objects:\n  count: 1.0e+999',
        'objects:\n  count: null',
        'objects:\n  count: [[[1]]]',
        'objects:\n  pan_deg: [.nan, .inf]',
        'objects: [1]',
        'objects: null',
        '- 1',
        'head: [ideal]',
        'head:\n  preset: [ideal]',
        'head:\n  preset: {a: b}',
        '? [a]\n: 1',
        'x' * 10**5 + ': 1',
        'name: ' + '[' + 'x, ' * 10**4 + ']',
        'name: !!python/name:os.system',
        'name: 2026-99-99',
        '#' * (2**20 + 1),
    ],
    ids=lambda text: repr(text[:30]),
)
def test_no_file_breaks_the_reader(text, tmp_path):
    path = tmp_path / 'hostile.yaml'
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(SceneError) as refused:
        load_scene(str(path))
    assert str(refused.value).startswith(str(path))
    assert '\n' not in str(refused.value)
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize('kind', ['folder', 'device', 'pipe'])
def test_what_is_no_file_is_refused(kind, tmp_path):
    path = tmp_path / 'x.yaml'
    if kind == 'folder':
        path.mkdir()
    elif kind == 'device':
        path.symlink_to('/dev/zero')
    else:
        os.mkfifo(path)
    with pytest.raises(SceneError, match='is needed'):
        load_scene(str(path))
