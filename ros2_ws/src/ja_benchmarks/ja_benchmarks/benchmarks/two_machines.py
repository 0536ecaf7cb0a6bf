"""The graph on two machines: the learner on a desktop, all else at the head, over a bad network.

Two hosts (namespaces of Linux: root) are joined by a cable that delays each frame on its one way
and loses some of them at random. The simulator runs in real time at 15 images/s, with the gate's
`hold_after_s` of `./ja rig`. Then the cable is cut for 5 s.
"""

import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ja_benchmarks.head_and_desktop import (
    HOLD_AFTER_S,
    Measured,
    Split,
    run_split,
)
from ja_benchmarks.rows import Row, percentile_99, row, share_row
from ja_common.core.config import ConfigError
from ja_diagnostics.faults.cable import TUN
from ja_diagnostics.faults.hosts import missing

_LEARNER = ('learning_module',)
_DELAY_S, _LOSS = 0.02, 0.05
SPLITS = {
    'no impairment': Split(_LEARNER),
    '20 ms one way': Split(_LEARNER, _DELAY_S),
    '5 % loss': Split(_LEARNER, 0.0, _LOSS),
    '20 ms and 5 % loss': Split(_LEARNER, _DELAY_S, _LOSS),
    '20 ms and 5 % loss, detector on the desktop too': Split(
        (*_LEARNER, 'salient_feature_detector'), _DELAY_S, _LOSS, cuts=0
    ),
}
_QUICK_S = 10.0


def run(quick: bool = False) -> dict[str, Row]:
    """Measure every split; the quick form for 10 s each, with one cut.

    Raises ConfigError where no hosts can be made.
    """
    if why := missing() or ('' if TUN.exists() else f'there is no {TUN}'):
        raise ConfigError(f'two_machines makes two hosts, which is not possible here: {why}')
    rows: dict[str, Row] = {}
    with TemporaryDirectory() as folder:
        for number, (name, split) in enumerate(SPLITS.items()):
            if quick:
                split = Split(**{**vars(split), 'measure_s': _QUICK_S, 'cuts': min(split.cuts, 1)})
            measured = run_split(split, Path(folder) / str(number))
            rows |= {f'{name}: {figure}': found for figure, found in rows_of(measured).items()}
    return rows


def rows_of(measured: Measured) -> dict[str, Row]:
    """Return the figures of one run."""
    delays_s = np.array(measured.delays_s)
    arrived_ms = 1e3 * delays_s[np.isfinite(delays_s)]
    minutes = measured.measured_s / 60
    rows = {
        f'answers within {HOLD_AFTER_S:g} s': share_row(delays_s <= HOLD_AFTER_S),
        'images decided on': _single(measured.decided / measured.measured_s, 'images/s'),
        'stops of the head': _single(
            sum(measured.stops.values()) / minutes, '1/min', sum(measured.stops.values())
        ),
        'time held': _single(measured.held_s / measured.measured_s, 'share'),
        'trials': _single(len(measured.trials) / minutes, '1/min', len(measured.trials)),
        'traffic of the link': _single(measured.link_bytes / measured.measured_s / 1e3, 'kB/s'),
    }
    if len(arrived_ms):
        rows['camera to answer, median'] = row(arrived_ms, 'ms', np.median)
        rows['camera to answer, 99th percentile'] = row(arrived_ms, 'ms', percentile_99)
    if measured.trials:
        rows['success'] = share_row(measured.trials, 'success')
    for name, seconds in (
        ('link cut for 5 s: head stands after', measured.stopped_s),
        ('link back: next decision after', measured.resumed_s),
    ):
        if seconds:
            rows[f'{name}, longest'] = _single(max(seconds), 's', len(seconds))
    return rows


def _single(value: float, unit: str, n: int = 1) -> Row:
    """Return a figure without an interval."""
    return {'value': value if math.isfinite(value) else math.nan, 'unit': unit, 'n': n,
            'interval': None}  # fmt: skip
