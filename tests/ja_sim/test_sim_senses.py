"""`sim` publishes depth and a second camera, with the stamp of the image and before it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ja_common.camera_info_codec import decode_calibration
from ja_common.image_codec import decode_image
from ja_common.time_codec import to_ns
from ja_common.topics import (
    CAMERA_INFO,
    DEPTH,
    IMAGE,
    JOINT_COMMANDS,
    RIGHT_CAMERA_INFO,
    RIGHT_IMAGE,
)
from ja_sim.core.scene import load_scene
from ja_sim.core.specs import SensesSpec
from ja_sim.core.world import JointAttentionWorld
from ja_sim.sim_node import SimNode
from node_bench import joint_state

SENSES = [DEPTH, RIGHT_CAMERA_INFO, RIGHT_IMAGE]
SIZE = {'image_width': 64, 'image_height': 48, 'resend_after_s': 0.2, 'scene': 'easy'}


@pytest.fixture
def start(make_bench: Callable[..., Any]) -> Callable[..., Any]:
    def make(**parameters: Any) -> Any:
        received = [IMAGE, CAMERA_INFO, *SENSES]
        return make_bench(SimNode, [JOINT_COMMANDS], received, **{**SIZE, **parameters})

    return make


def depth_of(message: Any) -> np.ndarray:
    """Return the depth (H, W) [m] of a message as any program reads it, NaN for holes."""
    kind = {'16UC1': np.dtype('<u2'), '32FC1': np.dtype('<f4')}[message.encoding]
    assert not message.is_bigendian
    assert message.step == message.width * kind.itemsize
    samples = np.frombuffer(message.data, kind).reshape(message.height, message.width)
    if message.encoding == '32FC1':
        return samples
    return np.where(samples > 0, samples / 1000.0, np.nan)


@pytest.mark.parametrize('encoding', ['16UC1', '32FC1'])
def test_depth_and_the_second_camera_come_with_the_stamp_of_the_image_and_before_it(
    start: Callable[..., Any], encoding: str
) -> None:
    bench = start(depth='sensor', second_camera='on', depth_encoding=encoding)
    order: list[Any] = []
    for topic in (*SENSES, IMAGE):
        publisher = bench.node._senses.get(topic, bench.node._image)
        publish = publisher.publish
        publisher.publish = lambda m, topic=topic, publish=publish: (
            order.append(topic),
            publish(m),
        )
    bench.wait(lambda: all(bench.messages(topic) for topic in (*SENSES, IMAGE)))
    bench.wait(lambda: IMAGE in order)
    assert order[: len(SENSES) + 1] == [*SENSES, IMAGE]
    image, depth, info, right = (
        bench.messages(topic)[-1] for topic in (IMAGE, DEPTH, RIGHT_CAMERA_INFO, RIGHT_IMAGE)
    )
    for message in (depth, info, right):
        assert message.header == image.header
    assert depth.encoding == encoding
    values = depth_of(depth)
    assert values.shape == (48, 64)
    known = np.isfinite(values)
    assert 0.5 < known.mean() < 1.0
    assert 0.25 < values[known].min() < 1.3 < values[known].max() < 4.0
    assert decode_image(right).shape == (48, 64, 3)
    assert bytes(right.data) != bytes(image.data)
    calibration = decode_calibration(info)
    assert calibration.p[3] == pytest.approx(-0.06 * calibration.k[0])
    assert bench.messages(CAMERA_INFO)[-1].p[3] == 0.0


@pytest.mark.parametrize('encoding', ['16UC1', '32FC1'])
def test_the_depth_is_that_of_the_world(start: Callable[..., Any], encoding: str) -> None:
    bench = start(depth='exact', depth_encoding=encoding)
    bench.wait(lambda: bench.messages(DEPTH))
    scene = load_scene('easy')
    world = JointAttentionWorld(replace(scene, senses=SensesSpec(depth='exact')), 0, (64, 48))
    world.step(0.1)
    expected = world.observe().depth
    world.close()
    assert expected is not None
    np.testing.assert_allclose(depth_of(bench.messages(DEPTH)[0]), expected, atol=0.000501)


@pytest.mark.parametrize(
    ('in_scene', 'parameters', 'on'),
    [
        (False, {}, False),
        (True, {}, True),
        (True, {'depth': 'none', 'second_camera': 'off'}, False),
        (False, {'depth': 'exact', 'second_camera': 'on'}, True),
    ],
)
def test_senses_are_as_in_the_scene_unless_a_parameter_switches_them(
    start: Callable[..., Any], tmp_path: Any, in_scene: bool, parameters: dict[str, Any], on: bool
) -> None:
    path = tmp_path / 'mine.yaml'
    switch = 'depth: exact\n  second_camera: true\n  ' * in_scene
    path.write_text(f'senses:\n  {switch}baseline_m: 0.1\n')
    bench = start(scene=str(path), **parameters)
    stamp = to_ns(bench.next(IMAGE).header.stamp)
    bench.publish(JOINT_COMMANDS, joint_state(stamp, 0.0, 0.0))
    bench.wait(lambda: to_ns(bench.messages(IMAGE)[-1].header.stamp) > stamp)
    assert [bool(bench.messages(topic)) for topic in SENSES] == [on] * 3
    if on:
        info = bench.messages(RIGHT_CAMERA_INFO)[-1]
        assert info.p[3] == pytest.approx(-0.1 * info.k[0])
