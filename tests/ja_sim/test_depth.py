"""Depth and a second camera of the simulated head."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from ja_common.core.geometry import directions_of_vectors, head_rotation, rays_of_directions
from ja_sim.core.camera import Intrinsics
from ja_sim.core.depth_sensor import DepthSensor
from ja_sim.core.scene import Scene, load_scene
from ja_sim.core.specs import HEAD_PRESETS, HeadSpec, SensesSpec
from ja_sim.core.world import JointAttentionWorld

SIZE = (320, 240)
LENS = Intrinsics.from_view(HeadSpec(), SIZE)
AWAY = np.radians([25.0, 5.0])
QUIET = SensesSpec(
    depth='sensor', disparity_noise_px=0.0, disparity_step_px=0.0, depth_scale_deviation=0.0
)

MakeWorld = Callable[..., JointAttentionWorld]


def scene(head: str = 'ideal', **senses: object) -> Scene:
    base = load_scene('default')
    return replace(base, head=HEAD_PRESETS[head], senses=SensesSpec(**senses))  # type: ignore[arg-type]


@pytest.fixture
def make_world() -> Iterator[MakeWorld]:
    worlds = []

    def make(a_scene: Scene, seed: int = 0, size: tuple[int, int] = SIZE) -> JointAttentionWorld:
        worlds.append(JointAttentionWorld(a_scene, seed, size))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()


def looks_at(world: JointAttentionWorld, direction: NDArray[np.float64]) -> None:
    world.command(direction)
    world.step(0.5)


def bare(a_scene: Scene, objects: int) -> Scene:
    """Return the scene between bare walls, with objects that stay."""
    return replace(
        a_scene,
        room=replace(a_scene.room, furnished=False),
        objects=replace(a_scene.objects, rearranged='never', count=objects),
    )


def outline_middle(image: NDArray[np.uint8]) -> float:
    """Return the column [px] in the middle of the only blue thing.

    Of its outline: a highlight on a shiny thing is elsewhere for each of two cameras.
    """
    blue = image[..., 2].astype(int) - image[..., 0] > 30  # nothing else is blue
    rows = np.flatnonzero(blue.any(axis=1))
    first, last = blue[rows].argmax(axis=1), blue[rows][:, ::-1].argmax(axis=1)
    return float(np.mean(first + (image.shape[1] - 1 - last)) / 2.0)


@pytest.mark.parametrize('size', [SIZE, (640, 480), (161, 121)])
def test_exact_depth_of_a_known_sphere_is_that_of_its_surface(
    make_world: MakeWorld, size: tuple[int, int]
) -> None:
    world = make_world(bare(scene(depth='exact'), objects=5), size=size)
    measured, expected = [], []
    for seed in range(12):
        world.reset(seed)
        for index, each in enumerate(world._arrangement.objects):
            if each.shape != 'sphere':
                continue
            looks_at(world, world.truth().directions[index])
            seen, distance = world.observe(), np.linalg.norm(each.position)
            assert seen.depth is not None
            assert (seen.depth.dtype, seen.depth.shape) == (np.float32, size[::-1])
            measured.append(seen.depth[size[1] // 2, size[0] // 2])
            expected.append(distance - each.radius_m)
    assert len(expected) >= 5
    np.testing.assert_allclose(measured, expected, atol=1e-3)


def test_exact_depth_of_the_back_wall_is_along_the_optical_axis(make_world: MakeWorld) -> None:
    """A wall that is square to the axis has one depth, however far a pixel is from the centre."""
    world = make_world(bare(scene(depth='exact'), objects=5))
    depth = world.observe().depth
    assert depth is not None
    wall = depth[:100][depth[:100] > 2.0]  # above the table; the rest is she and the objects
    assert wall.size > 10_000
    np.testing.assert_allclose(wall, 2.7, atol=1e-3)
    # Turned by the head, the wall is seen along the ray of each pixel.
    looks_at(world, np.radians([20.0, -12.0]))
    seen = world.observe()
    assert seen.depth is not None
    rotation = head_rotation(world.truth().posture)
    for row, column in ((5, 160), (20, 300), (100, 310)):
        ray = np.array([1.0, -(column - seen.cx) / seen.fx, -(row - seen.cy) / seen.fy])
        # Half a pixel of the drawn picture is where a sample may lie beside the centre.
        assert seen.depth[row, column] == pytest.approx(2.7 / (rotation @ ray)[0], abs=2e-3)


def test_exact_depth_of_her_face(make_world: MakeWorld) -> None:
    """The surface of her face is nearer than the middle between her eyes by less than the nose."""
    world = make_world(scene(depth='exact'), seed=2)
    observation, truth = world.observe(), world.truth()
    assert observation.depth is not None
    x, y = rays_of_directions(truth.posture, truth.face_direction)
    u, v = observation.fx * x + observation.cx, observation.fy * y + observation.cy
    face = observation.depth[round(v) - 8 : round(v) + 9, round(u) - 8 : round(u) + 9]
    distance = np.linalg.norm(truth.face_position)
    assert distance == pytest.approx(1.2, abs=0.01)
    assert abs(np.median(face) - distance) < 0.03
    np.testing.assert_allclose(directions_of_vectors(truth.face_position), truth.face_direction)


def test_depth_between_two_surfaces_is_of_one_of_them(make_world: MakeWorld) -> None:
    """An average across an edge would be the distance of nothing."""
    depth = make_world(bare(scene(depth='exact'), objects=5)).observe().depth
    assert depth is not None
    beside_her = depth[60:110]  # her head and the wall, no table
    assert ((beside_her < 1.45) | (beside_her > 2.69)).all()
    assert (beside_her < 1.45).any()


@pytest.mark.parametrize('head', ['ideal', 'hobby_servo'])
def test_senses_change_neither_picture_nor_encoders(make_world: MakeWorld, head: str) -> None:
    """Off, all is as before the senses were there; on, they have random streams of their own."""
    off = make_world(scene(head), 7)
    on = make_world(scene(head, depth='sensor', second_camera=True), 7)
    rng = np.random.default_rng(5)
    for step in range(12):
        command = rng.uniform(-0.5, 0.5, 2) if step % 4 else np.zeros(2)
        seen = []
        for world in (off, on):
            world.command(command)
            world.step(0.1)
            seen.append(world.observe())
        np.testing.assert_array_equal(seen[0].image, seen[1].image)
        np.testing.assert_array_equal(off.joint_state().position, on.joint_state().position)
        np.testing.assert_array_equal(off.truth().positions, on.truth().positions)
        assert seen[0].depth is None
        assert seen[0].right is None
    assert seen[1].depth is not None
    assert seen[1].right is not None


def test_same_seed_same_senses(make_world: MakeWorld) -> None:
    a_scene = scene('hobby_servo', depth='sensor', second_camera=True)
    runs = []
    for seed in (3, 3, 4):
        world = make_world(a_scene, seed)
        world.step(0.1)
        world.observe()
        world.step(0.1)
        runs.append(world.observe())
    np.testing.assert_array_equal(runs[0].depth, runs[1].depth)
    np.testing.assert_array_equal(runs[0].right, runs[1].right)
    both = np.isfinite(runs[0].depth) & np.isfinite(runs[2].depth)
    assert np.abs(runs[0].depth - runs[2].depth)[both].max() > 0.01


def test_observing_twice_gives_the_same_depth(make_world: MakeWorld) -> None:
    world = make_world(scene(depth='sensor'))
    np.testing.assert_array_equal(world.observe().depth, world.observe().depth)


def test_late_senses_are_of_the_exposure_of_the_picture(make_world: MakeWorld) -> None:
    lens = {'camera_rate_hz': 50.0}
    late, prompt = (
        make_world(replace(a_scene, head=replace(a_scene.head, **lens, camera_latency_s=latency)))
        for latency in (0.2, 0.0)
        for a_scene in [scene(depth='exact', second_camera=True)]
    )
    for world in (late, prompt):
        world.step(0.1)
        world.command(AWAY)
    prompt.step(0.02)
    late.step(0.22)
    seen, expected = late.observe(), prompt.observe()
    assert seen.stamp_ns == expected.stamp_ns
    np.testing.assert_array_equal(seen.depth, expected.depth)
    np.testing.assert_array_equal(seen.right, expected.right)


@pytest.mark.parametrize('size', [SIZE, (640, 480)])
@pytest.mark.parametrize('baseline_m', [0.06, 0.12])
def test_disparity_of_a_known_object_is_fx_b_over_z(
    make_world: MakeWorld, size: tuple[int, int], baseline_m: float
) -> None:
    """An object is seen by the second camera as far to the left as it must be."""
    world = make_world(bare(scene(second_camera=True, baseline_m=baseline_m), objects=1), 1, size)
    errors = []
    for seed in range(8):
        world.reset(seed)
        plain = {'shape': 'sphere', 'pattern': 'plain', 'colour': (0.1, 0.1, 1.0)}
        world._arrangement.objects = [replace(world._arrangement.objects[0], **plain)]
        looks_at(world, world.truth().directions[0])
        seen, distance = world.observe(), np.linalg.norm(world.truth().positions[0])
        assert seen.right is not None
        disparity = outline_middle(seen.image) - outline_middle(seen.right)
        errors.append(disparity - seen.fx * baseline_m / distance)
    assert np.max(np.abs(errors)) < 0.5


def test_the_second_camera_has_its_own_noise(make_world: MakeWorld) -> None:
    """Without a baseline worth the name both see the same, but for the noise of each."""
    a_scene = scene(second_camera=True, baseline_m=0.005)
    noisy = replace(a_scene, head=replace(a_scene.head, image_noise=5.0))
    seen, clean = make_world(noisy).observe(), make_world(a_scene).observe()
    assert seen.right is not None
    assert clean.right is not None
    noise = [
        noisy_one.astype(float) - clean_one
        for noisy_one, clean_one in ((seen.image, clean.image), (seen.right, clean.right))
    ]
    assert np.std(noise[1]) == pytest.approx(5.0, rel=0.1)
    assert abs(np.corrcoef(noise[0].ravel(), noise[1].ravel())[0, 1]) < 0.05


def measured(spec: SensesSpec, depth: NDArray[np.float32], seed: int = 0) -> NDArray[np.float32]:
    return DepthSensor(spec, LENS, np.random.default_rng(seed)).measure(depth)


def flat(depth_m: float) -> NDArray[np.float32]:
    return np.full(SIZE[::-1], depth_m, np.float32)


def test_noise_grows_with_the_square_of_the_distance() -> None:
    spec = replace(QUIET, disparity_noise_px=0.1)
    for depth_m in (0.5, 1.0, 2.0):
        found = measured(spec, flat(depth_m))
        expected = depth_m**2 * 0.1 / (spec.depth_focal_px * spec.depth_baseline_m)
        assert np.std(found) == pytest.approx(expected, rel=0.15)
        assert np.mean(found) == pytest.approx(depth_m, rel=0.005)


def test_errors_of_neighbours_are_alike_as_wide_as_the_matching_window() -> None:
    spec = replace(QUIET, disparity_noise_px=0.1)
    correlations = []
    for window_px in (0.0, 8.0):
        noise = measured(replace(spec, matching_window_px=window_px), flat(1.0)) - 1.0
        correlations.append(np.corrcoef(noise[:, :-1].ravel(), noise[:, 1:].ravel())[0, 1])
    assert abs(correlations[0]) < 0.05
    assert correlations[1] > 0.7


def test_depth_comes_in_steps_of_disparity() -> None:
    spec = replace(QUIET, disparity_step_px=0.125)
    slope = np.linspace(1.0, 1.2, SIZE[0], dtype=np.float32)
    found = measured(spec, np.tile(slope, (SIZE[1], 1)))
    disparity = spec.depth_focal_px * spec.depth_baseline_m / np.unique(found)
    np.testing.assert_allclose(np.round(disparity / 0.125), disparity / 0.125, atol=1e-3)
    assert 30 < len(disparity) < 60


def test_the_error_of_calibration_is_one_for_a_run() -> None:
    spec = replace(QUIET, depth_scale_deviation=0.05)
    sensor = DepthSensor(spec, LENS, np.random.default_rng(0))
    first, second = sensor.measure(flat(1.0)), sensor.measure(flat(2.0))
    assert np.ptp(first) < 1e-6
    np.testing.assert_allclose(second, 2.0 * first, rtol=1e-6)
    scales = [measured(spec, flat(1.0), seed)[0, 0] for seed in range(200)]
    assert np.std(scales) == pytest.approx(0.05, rel=0.2)


def test_too_near_and_too_far_give_no_depth() -> None:
    for depth_m, known in ((0.2, False), (0.3, True), (3.9, True), (4.1, False)):
        assert np.isfinite(measured(QUIET, flat(depth_m))).all() == known


def test_the_shadow_of_a_near_thing_is_on_its_left() -> None:
    """What the right imager cannot see behind a near thing has no depth: (d_near - d_far) px."""
    depth = flat(2.0)
    depth[80:160, 150:200] = 0.8
    found = measured(replace(QUIET, grazing_deg=90.0), depth)
    hole = np.isnan(found[120])
    width = LENS.fx * QUIET.depth_baseline_m * (1 / 0.8 - 1 / 2.0)
    assert abs(hole.sum() - width) <= 2
    assert hole[150 - int(width) + 1 : 150].all()
    assert not hole[150:].any()
    assert not np.isnan(found[:79]).any()


def test_steep_surfaces_give_no_depth() -> None:
    """A wall along the line of sight, turned away by more than the limit, and one by less."""
    columns = (np.arange(SIZE[0]) - LENS.cx) / LENS.fx
    for angle_deg, known in ((70.0, True), (85.0, False)):
        # A plane through (0, 0, 1.5), whose normal is turned by this angle.
        slope = np.tan(np.radians(angle_deg))
        row = 1.5 / (1.0 - slope * columns)
        depth = np.tile(row.astype(np.float32), (SIZE[1], 1))[:, 155:165].copy()
        lens = replace(LENS, width=10, cx=LENS.cx - 155)
        found = DepthSensor(QUIET, lens, np.random.default_rng(0)).measure(depth)
        assert np.isfinite(found[:, 2:-2]).all() == known


def test_holes_are_at_the_edges_of_things(make_world: MakeWorld) -> None:
    world = make_world(scene(depth='sensor'))
    exact = make_world(scene(depth='exact'))
    found, depth = world.observe().depth, exact.observe().depth
    assert found is not None
    assert depth is not None
    hole = np.isnan(found)
    assert 0.01 < hole.mean() < 0.25
    span = cv2.dilate(depth, np.ones((1, 41))) - cv2.erode(depth, np.ones((1, 41)))
    tall = cv2.dilate(depth, np.ones((3, 1))) - cv2.erode(depth, np.ones((3, 1)))
    assert ((span > 0.05) | (tall > 0.02))[hole].mean() > 0.95
    known = ~hole & (span < 0.2)
    relative = np.abs(found - depth)[known] / depth[known]
    assert np.median(relative) < 0.03
