"""Run the calibration node until it has a result, and end it with the head at rest."""

import time
from collections.abc import Callable, Sequence
from typing import Any

from ja_calibration.calibration_file import as_dict
from ja_calibration.calibrator import Calibrator
from ja_common.executor import CachedWaitSetExecutor
from ja_common.private_context import private_executor
from ja_common.stop_signals import StopSignals

_BRAKING_S = 3.0


def run_calibration(
    arguments: Sequence[str], patience_s: float, report: Callable[[str], None]
) -> dict[str, Any]:
    """Calibrate the head and return the contents of the file.

    `report` receives a line of progress after each move. Raises ValueError where the head or the
    images allow no calibration, and KeyboardInterrupt after a signal, once the head stands still.
    """
    # A signal must end nothing at once: the head has to brake first.
    with StopSignals() as stop, private_executor(arguments) as executor:
        node = Calibrator(context=executor.context)
        executor.add_node(node)
        try:
            _spin_until_done(node, executor, stop, patience_s, report)
            assert node.sequence is not None
            assert node.sequence.result is not None
            pan, tilt = (bool(sign < 0) for sign in node.joints.signs)
            return as_dict(node.sequence.result, (pan, tilt), node.image_size)
        finally:
            _brake(node, executor)


def _spin_until_done(
    node: Calibrator,
    executor: CachedWaitSetExecutor,
    stop: StopSignals,
    patience_s: float,
    report: Callable[[str], None],
) -> None:
    done, progress_s = -1, time.monotonic()
    while node.sequence is None or node.sequence.result is None:
        stop.raise_if_requested()
        executor.spin_once(timeout_sec=0.1)
        if node.refusal is not None:
            raise node.refusal
        now_done = -1 if node.sequence is None else node.sequence.moves_done
        if now_done != done:
            done, progress_s = now_done, time.monotonic()
            report(f'{done} moves done ...')
        if time.monotonic() - progress_s > patience_s:
            why = f'last held because: {node.last_hold}' if node.last_hold else 'never held'
            raise ValueError(f'no progress for {patience_s:g} s; the head was {why}')


def _brake(node: Calibrator, executor: CachedWaitSetExecutor) -> None:
    node.stop()
    # The error that ended the run is on its way already; do not raise a second one.
    node.sequence = None
    end_s = time.monotonic() + _BRAKING_S
    while not node.at_rest and time.monotonic() < end_s:
        executor.spin_once(timeout_sec=0.1)
