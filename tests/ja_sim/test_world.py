"""The world as the robot meets it: through pictures, encoders and commands."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest

from ja_common.core.config import ConfigError
from ja_common.core.geometry import angle_between, rays_of_directions
from ja_perception.core.haar import read_cascade
from ja_sim.core import graphics
from ja_sim.core.caregiver import SKIN_TONES, identities
from ja_sim.core.graphics import RenderError
from ja_sim.core.scene import Scene, load_scene
from ja_sim.core.specs import HEAD_PRESETS
from ja_sim.core.world import JointAttentionWorld

SMALL = (160, 120)
AWAY = np.radians([25.0, 5.0])


def scene(**parts: dict) -> Scene:
    """Return the default scene with some settings of some parts changed."""
    base = load_scene('default')
    return replace(
        base, **{name: replace(getattr(base, name), **change) for name, change in parts.items()}
    )


@pytest.fixture
def make_world() -> Iterator[Callable[..., JointAttentionWorld]]:
    worlds = []

    def make(a_scene: Scene | None = None, seed: int = 0, size=SMALL) -> JointAttentionWorld:
        worlds.append(JointAttentionWorld(a_scene or load_scene('default'), seed, size))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()


def run(world: JointAttentionWorld, steps: int = 25) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return pictures and encoder readings of a run that looks around and back at her."""
    rng = np.random.default_rng(5)
    images, readings = [], []
    for step in range(steps):
        if step % 4 == 0:
            world.command(rng.uniform(-0.5, 0.5, 2) if step % 8 else np.zeros(2))
        world.step(0.1)
        images.append(world.observe().image)
        sample = world.joint_state()
        readings.append(np.concatenate([sample.position, sample.velocity]))
    return images, readings


@pytest.mark.parametrize('head', ['ideal', 'hobby_servo'])
def test_same_seed_and_commands_give_the_same_run_bit_for_bit(make_world, head):
    a_scene = replace(scene(objects={'moving_share': 0.5}), head=HEAD_PRESETS[head])
    first, second = run(make_world(a_scene, 7)), run(make_world(a_scene, 7))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_reset_is_as_good_as_a_new_world(make_world):
    world = make_world(seed=3)
    first = run(world)
    world.reset()
    for a, b in zip(first, run(world), strict=True):
        np.testing.assert_array_equal(a, b)
    world.reset(4)
    for a, b in zip(run(world), run(make_world(seed=4)), strict=True):
        np.testing.assert_array_equal(a, b)


def test_looking_changes_nothing(make_world):
    a_scene = replace(load_scene('default'), head=HEAD_PRESETS['hobby_servo'])
    watched, blind = make_world(a_scene), make_world(a_scene)
    for world in (watched, blind):
        for step in range(20):
            world.command(AWAY * (step % 2))
            world.step(0.05)
            if world is watched:
                world.render_picture(head=np.radians([40.0, 0.0]))
                world.truth()
                world.joint_state()
    np.testing.assert_array_equal(watched.joint_state().position, blind.joint_state().position)
    np.testing.assert_array_equal(watched.render_picture(), blind.render_picture())


def test_other_seeds_give_other_worlds(make_world):
    world = make_world(seed=0)
    image = world.observe().image
    world.reset(1)
    assert np.abs(image.astype(int) - world.observe().image).mean() > 2.0


@pytest.mark.parametrize('posture_deg', [(0.0, 0.0), (20.0, -8.0), (-30.0, 12.0)])
@pytest.mark.parametrize('size', [SMALL, (320, 240)])
def test_things_are_seen_where_the_intrinsics_say(make_world, posture_deg, size):
    """The middle of each object's colour is where its direction projects to."""
    world = make_world(
        scene(room={'furnished': False, 'light_variation': 0.0}, objects={'count': 1}), 2, size
    )
    world.command(np.radians(posture_deg))
    world.step(0.3)
    errors = []
    for seed in range(40):
        world.reset(seed)
        world.command(np.radians(posture_deg))
        world.step(0.3)
        truth, observation = world.truth(), world.observe()
        ray = rays_of_directions(truth.posture, truth.directions[0])
        u = observation.fx * ray[0] + observation.cx
        v = observation.fy * ray[1] + observation.cy
        margin = size[0] / 8.0
        if not (margin < u < size[0] - margin and margin < v < size[1] - margin):
            continue
        image = observation.image.astype(int)
        rows, columns = np.nonzero(np.ptp(image, axis=2) > 90)
        errors.append([np.median(columns) - u, np.median(rows) - v])
    # Shading and spots draw the median off the middle, differently from one to the next.
    assert len(errors) >= 4
    assert np.all(np.median(np.abs(errors), axis=0) < size[0] / 120.0)


def test_the_view_is_what_the_scene_says(make_world):
    intrinsics = make_world(size=(320, 240)).intrinsics
    edges = np.degrees(np.arctan([160 / intrinsics.fx, 120 / intrinsics.fy]))
    np.testing.assert_allclose(edges, [18.0, 13.5])
    assert (intrinsics.cx, intrinsics.cy) == (159.5, 119.5)


def test_a_trial_begins_when_the_robot_looks_at_her(make_world):
    world = make_world(seed=1)
    world.command(AWAY)
    world.step(0.2)
    world.reset()
    assert world.truth().trial == 0
    assert world.truth().attended == -1
    world.step(0.1)
    assert world.truth().trial == 1
    ids = world.truth().object_ids
    world.step(0.5)
    assert world.truth().trial == 1
    world.command(AWAY)
    world.step(0.2)
    world.command(np.zeros(2))
    world.step(0.2)
    assert world.truth().trial == 2
    assert not set(ids) & set(world.truth().object_ids)


def test_she_turns_to_the_object_after_a_reaction_time(make_world):
    world = make_world(scene(caregiver={'head_noise_deg': 0.0, 'head_share': (1.0, 1.0)}), 2)
    world.step(0.05)
    rest = world.truth().head
    world.step(0.15)
    np.testing.assert_allclose(world.truth().head, rest)
    world.step(0.4)
    truth = world.truth()
    # Straight ahead of her turned face, seen from between her eyes, is the attended object.
    target = truth.positions[truth.attended]
    np.testing.assert_array_equal(truth.gaze_target, target)
    toward_her_left = -1.0
    assert np.sign(truth.head[0]) == np.sign(target[1]) * toward_her_left
    np.testing.assert_allclose(
        truth.head[0], np.arctan2(-target[1], 1.2 - target[0]), atol=np.radians(12.0)
    )


def test_an_unreliable_caregiver_looks_elsewhere(make_world):
    world = make_world(scene(caregiver={'reliability': 0.0}))
    world.step(0.1)
    truth = world.truth()
    assert not truth.reliable
    assert np.linalg.norm(truth.gaze_target - truth.positions[truth.attended]) > 0.01


def test_in_view_at_look_is_about_the_moment_of_the_look(make_world):
    world = make_world()
    in_view = []
    for _ in range(30):
        world.command(AWAY)
        world.step(0.2)
        world.command(np.zeros(2))
        world.step(0.2)
        truth = world.truth()
        x, y = rays_of_directions([0.0, 0.0], truth.directions[truth.attended])
        shown = abs(x) < np.tan(np.radians(18.0)) and abs(y) < np.tan(np.radians(13.5))
        assert truth.in_view_at_look == shown
        in_view.append(truth.in_view_at_look)
    assert 0 < sum(in_view) < 30


def test_an_attended_object_can_be_shaken_or_held(make_world):
    still, shaking, holding = (
        make_world(scene(caregiver={'shows_object': how}), seed=4)
        for how in ('no', 'shakes', 'holds')
    )
    moved = []
    for world in (still, shaking, holding):
        world.step(0.1)
        world.step(0.55)
        before = world.truth().positions
        world.step(0.1)
        moved.append(np.linalg.norm(world.truth().positions - before, axis=1) > 1e-4)
    assert not moved[0].any()
    assert moved[1].nonzero()[0].tolist() == [shaking.truth().attended]
    assert not moved[2].any()
    np.testing.assert_array_equal(still.truth().positions, holding.truth().positions)
    # Her arm is seen when the robot looks at the object.
    pictures = []
    for world in (still, holding):
        world.command(world.truth().directions[world.truth().attended])
        world.step(0.2)
        pictures.append(world.render_picture().astype(int))
    assert np.abs(pictures[0] - pictures[1]).max(axis=2).astype(bool).mean() > 0.005


def test_pictures_are_stamped_with_their_exposure(make_world):
    ideal = make_world()
    ideal.step(0.1)
    assert ideal.observe().stamp_ns == ideal.now_ns == ideal.joint_state().stamp_ns
    hobby = make_world(scene(head={'camera_rate_hz': 20.0, 'camera_latency_s': 0.06}))
    start_ns = hobby.now_ns
    ages = []
    for _ in range(40):
        hobby.step(0.01)
        stamp_ns = hobby.observe().stamp_ns
        assert (stamp_ns - start_ns) % 50_000_000 == 0
        ages.append(hobby.now_ns - stamp_ns)
    # From the latency on, until the next picture has arrived.
    assert min(ages[10:]) == 60_000_000
    assert max(ages[10:]) == 100_000_000


def test_no_exposure_is_missed_by_steps_that_end_just_before_it(make_world):
    """Three steps of 1/90 s, in whole nanoseconds, are a little less than 1/30 s."""
    world = make_world(scene(head={'camera_rate_hz': 30.0}))
    stamps = set()
    for _ in range(90):
        world.step(1 / 90)
        stamps.add(world.observe().stamp_ns)
    assert len(stamps) >= 30


def test_a_late_picture_shows_the_posture_of_its_stamp(make_world):
    a_scene = scene(head={'camera_rate_hz': 50.0, 'camera_latency_s': 0.2})
    late, prompt = make_world(a_scene), make_world(scene(head={'camera_rate_hz': 50.0}))
    for world in (late, prompt):
        world.step(0.1)
        world.command(AWAY)
    prompt.step(0.02)
    late.step(0.22)
    assert late.observe().stamp_ns == prompt.observe().stamp_ns
    np.testing.assert_array_equal(late.observe().image, prompt.observe().image)
    then, now = late.truth_at_exposure(), late.truth()
    assert then.stamp_ns == late.observe().stamp_ns == prompt.truth().stamp_ns
    np.testing.assert_array_equal(then.posture, prompt.truth().posture)
    assert np.linalg.norm(now.posture - then.posture) > 0.05


def test_exposure_blurs_brightens_and_adds_noise(make_world):
    plain = make_world(scene())
    noisy = make_world(scene(head={'image_noise': 5.0}))
    bright = make_world(scene(head={'exposure_gain': 1.3}))
    images = [world.observe().image.astype(float) for world in (plain, noisy, bright)]
    assert (images[1] - images[0]).std() == pytest.approx(5.0, rel=0.1)
    assert images[2].mean() > 1.15 * images[0].mean()
    sharp, blurred = (
        make_world(scene(head={'exposure_time_s': time_s, 'servo_frequency_rad_s': 20.0}))
        for time_s in (0.0, 0.03)
    )
    edges = []
    for world in (sharp, blurred):
        world.command(AWAY)
        world.step(0.06)
        image = cv2.cvtColor(world.observe().image, cv2.COLOR_RGB2GRAY).astype(float)
        edges.append(np.abs(np.diff(image, axis=1)).mean())
    assert edges[1] < 0.6 * edges[0]


@pytest.mark.parametrize(
    'bad', [[np.nan, 0.0], [np.inf, 0.0], [0.1], [0.1, 0.2, 0.3], [[0.1, 0.2]]]
)
def test_a_bad_command_is_refused_and_changes_nothing(make_world, bad):
    world = make_world()
    world.command(AWAY)
    world.step(0.2)
    with pytest.raises(ValueError, match='two finite numbers'):
        world.command(np.array(bad))
    world.step(0.2)
    np.testing.assert_allclose(world.joint_state().position, AWAY, atol=1e-4)


def test_clamping_is_told(make_world):
    world = make_world()
    world.command(np.array([2.0, 0.0]))
    assert world.clamped
    world.step(0.2)
    assert world.joint_state().position[0] == pytest.approx(world.limits[0, 1], abs=1e-4)
    world.command(np.zeros(2))
    assert not world.clamped


@pytest.mark.parametrize('dt', [0.0, -0.1, float('nan'), float('inf')])
def test_time_only_passes_forwards(make_world, dt):
    with pytest.raises(ValueError, match='positive number of seconds'):
        make_world().step(dt)


def test_an_unknown_identity_is_refused_with_the_known_ones():
    with pytest.raises(ConfigError, match=f'choose any or {identities()[0]}'):
        JointAttentionWorld(scene(caregiver={'identity': 'zoe'}), 0, SMALL)


@pytest.mark.parametrize('turn_deg', [0.0, 40.0, -60.0])
def test_a_face_detector_finds_her(make_world, turn_deg):
    """OpenCV's frontal and profile cascades were not trained on rendered faces."""
    cascades = [read_cascade(name) for name in ('frontalface_alt2', 'profileface')]
    found = 0
    for name in identities()[:4]:
        world = make_world(scene(caregiver={'identity': name}), size=(320, 240))
        picture = world.render_picture(head=np.radians([turn_deg, 5.0]), eyes_closed=False)
        grey = cv2.resize(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), None, fx=2, fy=2)
        hits = [
            box
            for cascade in cascades
            for view in (grey, grey[:, ::-1].copy())
            for box in cascade.detectMultiScale(view, 1.1, 4, minSize=(80, 80))
        ]
        found += any(abs(x + w / 2 - 320) < 80 and abs(y + h / 2 - 240) < 80
                     for x, y, w, h in hits)  # fmt: skip
    assert found >= 3


def test_eyes_alone_are_visible(make_world):
    """Without a turn of the head, the whites of the eyes show where she looks."""
    still = {'head_share': (0.0, 0.0), 'head_noise_deg': 0.0, 'blink_rate_hz': 0.0}
    world = make_world(scene(caregiver=still), size=(320, 240))
    before = world.observe().image.astype(int)
    world.step(0.1)
    world.step(0.6)
    eyes = np.abs(world.observe().image.astype(int) - before)[90:130, 130:190]
    assert eyes.max() > 40


def test_nothing_but_objects_is_bright(make_world):
    """Room, clothes and hair are less colourful than the palest skin; objects are more."""
    skin = max(1.0 - min(tone) / max(tone) for tone in SKIN_TONES)
    world = make_world(scene(objects={'count': 1}))
    for seed in range(6):
        world.reset(seed)
        world.command(np.radians([40.0 * (-1) ** seed, 10.0]))
        world.step(0.3)
        truth = world.truth()
        hsv = cv2.cvtColor(world.observe().image, cv2.COLOR_RGB2HSV)
        off_axis = angle_between(truth.posture, truth.directions[0])
        if off_axis > np.radians(30.0):  # the object is out of view: only the room is in it
            lit = hsv[..., 2] > 30
            assert hsv[..., 1][lit].max() < 255 * skin


def test_an_unknown_backend_is_refused(monkeypatch):
    monkeypatch.setenv('MUJOCO_GL', 'glfw')
    with pytest.raises(RenderError, match="renders with 'egl' or 'osmesa'"):
        JointAttentionWorld(load_scene('default'), 0, SMALL).observe()


def test_missing_graphics_name_the_packages(monkeypatch):
    monkeypatch.delenv('MUJOCO_GL', raising=False)
    monkeypatch.setattr(graphics.ctypes.util, 'find_library', lambda name: None)
    with pytest.raises(RenderError, match='apt install libegl1 libgl1-mesa-dri'):
        JointAttentionWorld(load_scene('default'), 0, SMALL).observe()
    # A named library that is missing is reported before MuJoCo fails to load it.
    monkeypatch.setenv('MUJOCO_GL', 'osmesa')
    with pytest.raises(RenderError, match='MUJOCO_GL=osmesa is not there'):
        graphics.require_named_backend()


def test_osmesa_is_the_fallback(monkeypatch):
    monkeypatch.delenv('MUJOCO_GL', raising=False)
    only_osmesa = {'OSMesa': 'libOSMesa.so.8'}
    monkeypatch.setattr(graphics.ctypes.util, 'find_library', only_osmesa.get)
    assert graphics.choose_backend() == 'osmesa'


def assert_ends_without_an_error(code):
    ran = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, '')


def test_a_world_that_was_not_closed_ends_without_an_error():
    """Also where another library registered finalizers first: they run in the reverse order."""
    code = (
        'import weakref\n'
        'from ja_sim.core.scene import load_scene\n'
        'from ja_sim.core.world import JointAttentionWorld\n'
        'class Other: pass\n'
        'other = Other()\n'
        'weakref.finalize(other, id, None)\n'
        "world = JointAttentionWorld(load_scene('easy'), 0, (32, 24))\n"
        'world.observe()\n'
    )
    assert_ends_without_an_error(code)


def test_a_world_that_another_thread_still_holds_at_the_end_logs_no_error_either():
    """The case of a sim node that gets Ctrl-C while its first picture is drawn."""
    code = (
        'import atexit, threading\n'
        'kept, drawn = [], threading.Event()\n'
        'atexit.register(kept.clear)\n'  # let go of it after OpenGL was shut down
        'from ja_sim.core.scene import load_scene\n'
        'from ja_sim.core.world import JointAttentionWorld\n'
        'def draw():\n'
        "    kept.append(JointAttentionWorld(load_scene('easy'), 0, (32, 24)))\n"
        '    kept[0].observe()\n'
        '    drawn.set()\n'
        '    threading.Event().wait()\n'
        'threading.Thread(target=draw, daemon=True).start()\n'
        'drawn.wait()\n'
    )
    assert_ends_without_an_error(code)
