"""The simulator's truth on the wire: PointCloud2, one row an object."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from ja_common.point_cloud_codec import decode_columns, encode_columns
from ja_common.time_codec import to_ns
from ja_sim.core.score import TruthAt

if TYPE_CHECKING:  # the scorer reads this module and needs no MuJoCo
    from ja_sim.core.world import WorldTruth

FIELDS = ('x', 'y', 'z', 'pan', 'tilt', 'attended', 'in_view', 'trial')


def encode_truth(header: Header, truth: WorldTruth) -> PointCloud2:
    """Encode each object's position [m] and direction [rad], the attended one, and the trial."""
    count = len(truth.positions)
    columns = [*truth.positions.T, *truth.directions.T]
    columns.append(np.arange(count) == truth.attended)
    columns += [np.full(count, truth.in_view_at_look), np.full(count, truth.trial)]
    return encode_columns(header, dict(zip(FIELDS, columns, strict=True)))


def decode_truth(message: PointCloud2) -> TruthAt:
    """Decode what the scorer needs. Raises ValueError when the message is something else."""
    columns = decode_columns(message, FIELDS)
    attended = np.flatnonzero(columns['attended'])
    if not len(columns['trial']):
        raise ValueError('the truth holds no object')
    if len(attended) > 1:
        raise ValueError(f'{len(attended)} objects are marked as attended; it must be one')
    return TruthAt(
        to_ns(message.header.stamp),
        int(columns['trial'][0]),
        np.column_stack([columns['pan'], columns['tilt']]).astype(float),
        int(attended[0]) if len(attended) else -1,
        bool(columns['in_view'][0]),
    )
