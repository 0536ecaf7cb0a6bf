"""Runs the node that calibrates, and ends it with the head at rest."""

import time
from collections.abc import Callable, Sequence
from typing import Any

from ja_calibration.calibration_file import as_dict
from ja_calibration.rig import CalibrationRig
from ja_common.executor import CachedWaitSetExecutor
from ja_common.private_executor import own_executor

_BRAKING_S = 3.0


def run_calibration(
    arguments: Sequence[str], patience_s: float, say: Callable[[str], None]
) -> dict[str, Any]:
    """What was found, as the file has it.

    Raises ValueError where head or picture allow none, and KeyboardInterrupt when the head stands.
    """
    # Ctrl-C does not end the context: the head is still to be braked.
    with own_executor(arguments) as executor:
        rig = CalibrationRig(context=executor.context)
        executor.add_node(rig)
        try:
            _spin_until_found(rig, executor, patience_s, say)
            assert rig.conductor is not None
            assert rig.conductor.found is not None
            pan, tilt = (bool(sign < 0) for sign in rig.joints.signs)
            return as_dict(rig.conductor.found, (pan, tilt), rig.image_size)
        finally:
            _brake(rig, executor)


def _spin_until_found(
    rig: CalibrationRig,
    executor: CachedWaitSetExecutor,
    patience_s: float,
    say: Callable[[str], None],
) -> None:
    done, went_on_s = -1, time.monotonic()
    while rig.conductor is None or rig.conductor.found is None:
        executor.spin_once(timeout_sec=0.1)
        now_done = -1 if rig.conductor is None else rig.conductor.orders_done
        if now_done != done:
            done, went_on_s = now_done, time.monotonic()
            say(f'{done} moves done ...')
        if time.monotonic() - went_on_s > patience_s:
            why = f'last held because: {rig.last_hold}' if rig.last_hold else 'never held'
            raise ValueError(f'nothing went on for {patience_s:g} s; the head was {why}')


def _brake(rig: CalibrationRig, executor: CachedWaitSetExecutor) -> None:
    rig.stop()
    # What the end was about has been said already.
    rig.conductor = None
    end_s = time.monotonic() + _BRAKING_S
    while not rig.at_rest and time.monotonic() < end_s:
        executor.spin_once(timeout_sec=0.1)
