"""The node of `./ja calibrate`: it starts where the head stands, turns gently, and stops."""

from collections.abc import Callable

import numpy as np
import pytest

from ja_calibration.calibrator import Calibrator
from ja_common.image_codec import encode_image
from ja_common.topics import IMAGE, JOINT_COMMANDS, JOINT_STATES
from node_bench import NodeBench

BLANK = np.zeros((48, 64, 3), np.uint8)
START = (0.3, -0.1)


@pytest.fixture
def bench(make_bench: Callable[..., NodeBench]) -> NodeBench:
    return make_bench(
        Calibrator,
        publishes=[JOINT_STATES, IMAGE],
        subscribes=[JOINT_COMMANDS],
        stall_error_rad=3.0,
    )


def publish_now(bench: NodeBench) -> None:
    stamp_ns = bench.peer.get_clock().now().nanoseconds
    bench.publish(IMAGE, encode_image(BLANK, bench.peer.get_clock().now().to_msg(), 'eye'))
    bench.publish_posture(stamp_ns, *START)


def commands(bench: NodeBench, count: int) -> np.ndarray:
    """Return `count` more commands, (count, 2) [rad], while images and joint states come."""
    before = len(bench.messages(JOINT_COMMANDS))

    def enough() -> bool:
        publish_now(bench)
        return len(bench.messages(JOINT_COMMANDS)) >= before + count

    bench.wait(enough)
    return np.array([list(m.position) for m in bench.messages(JOINT_COMMANDS)[before:]])


def test_starts_where_the_head_stands_and_turns_gently(bench: NodeBench) -> None:
    positions = commands(bench, 60)
    assert positions[0] == pytest.approx(START, abs=0.001)
    assert np.abs(positions[-1] - START).max() > 0.02
    steps = np.diff(positions, axis=0)
    assert np.abs(steps).max() <= 0.35 * 0.01 + 1e-9
    assert np.abs(np.diff(steps, axis=0)).max() <= 1.5 * 0.01**2 + 1e-9


def test_stopped_it_brakes_and_holds(bench: NodeBench) -> None:
    commands(bench, 30)
    assert not bench.node.at_rest
    bench.node.stop()

    def braked() -> bool:
        # With images and joint states: without them the guard holds the head by itself.
        publish_now(bench)
        return bench.node.at_rest

    bench.wait(braked)
    # Longer than the head stands still between two moves.
    positions = commands(bench, 100)
    assert np.ptp(positions, axis=0) == pytest.approx(np.zeros(2))


def test_two_nodes_do_not_command_one_head(make_bench: Callable[..., NodeBench]) -> None:
    bench = make_bench(Calibrator, publishes=[JOINT_STATES, IMAGE])
    bench.peer.create_publisher(
        JOINT_COMMANDS.type, JOINT_COMMANDS.name, JOINT_COMMANDS.publisher_qos
    )
    bench.wait(lambda: bench.node.count_publishers(JOINT_COMMANDS.name) == 2)

    def refused() -> bool:
        publish_now(bench)
        return bench.node.refusal is not None

    bench.wait(refused)
    assert 'two nodes cannot command one head' in str(bench.node.refusal)


def test_a_start_near_the_limits_is_refused(make_bench: Callable[..., NodeBench]) -> None:
    bench = make_bench(Calibrator, publishes=[JOINT_STATES, IMAGE], pan_max_rad=0.35)

    def refused() -> bool:
        publish_now(bench)
        return bench.node.refusal is not None

    bench.wait(refused)
    assert 'within its limits' in str(bench.node.refusal)


def test_images_of_a_camera_on_its_side_are_turned(
    make_bench: Callable[..., NodeBench],
) -> None:
    bench = make_bench(Calibrator, publishes=[JOINT_STATES, IMAGE], image_rotation_deg=270)

    def turned() -> bool:
        publish_now(bench)
        return bench.node.image_size == (48, 64)

    bench.wait(turned)
