"""Choose the numbers that the paper does not give, from the table of a sweep.

The rule was stated before the sweep was run. Of the settings whose curves have the shape of the
paper's Figure 6 (b), take the one with the highest success in the last block, as the mean over the
object counts. A curve has that shape if

* success in the first block is at most `NEAR_CHANCE` above chance, and
* it crosses half of its rise after stage I and before stage III.

The sweeps are `choice_all.yaml` and `choice_last.yaml`; docs/paper.md gives the commands.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
from numpy.typing import NDArray

from ja_experiments.paper.experiment import STAGES

NEAR_CHANCE = 0.05


@dataclass(frozen=True)
class Candidate:
    """One combination of the swept settings.

    `curves`: online success by object count, (blocks,), means over seeds.
    """

    settings: dict[str, Any]
    curves: Mapping[int, NDArray[np.float64]]

    @property
    def ends(self) -> dict[int, float]:
        """Return success in the last block by object count."""
        return {objects: float(curve[-1]) for objects, curve in self.curves.items()}

    @property
    def success(self) -> float:
        """Return success in the last block, as the mean over the object counts."""
        return float(np.mean(list(self.ends.values())))

    @property
    def has_shape_of_paper(self) -> bool:
        """Return whether every curve starts near chance and rises between stages I and III."""
        return all(_has_shape(curve, objects) for objects, curve in self.curves.items())


def _has_shape(curve: NDArray[np.float64], objects: int) -> bool:
    half_way = int(np.argmax(curve >= (curve[0] + curve[-1]) / 2))
    near_chance = curve[0] <= 1 / objects + NEAR_CHANCE
    return bool(near_chance and STAGES['I'] < half_way < STAGES['III'])


def rank_candidates(rows: Sequence[Mapping[str, Any]]) -> list[Candidate]:
    """Return the candidates of a sweep's rows: those with the paper's shape first, best first."""
    swept = [
        name
        for name in rows[0]
        if name not in ('objects', 'seed') and not _is_result(name) and _differs(rows, name)
    ]

    def key(row: Mapping[str, Any]) -> tuple[Any, ...]:
        return tuple(row[name] for name in swept)

    candidates = [
        Candidate(dict(zip(swept, values, strict=True)), _curves(list(group)))
        for values, group in groupby(sorted(rows, key=key), key)
    ]
    return sorted(candidates, key=lambda c: (c.has_shape_of_paper, c.success), reverse=True)


def _is_result(name: str) -> bool:
    return name.startswith(('online_', 'alone_'))


def _differs(rows: Sequence[Mapping[str, Any]], name: str) -> bool:
    return any(row[name] != rows[0][name] for row in rows)


def _curves(rows: Sequence[Mapping[str, Any]]) -> dict[int, NDArray[np.float64]]:
    return {
        objects: np.mean([r['online_by_block'] for r in rows if r['objects'] == objects], axis=0)
        for objects in sorted({row['objects'] for row in rows})
    }


def main() -> None:
    """Print the candidates of the table named on the command line, the chosen one first."""
    rows = pyarrow.parquet.read_table(Path(sys.argv[1])).to_pylist()
    for candidate in rank_candidates(rows):
        settings = ', '.join(f'{name} {value}' for name, value in candidate.settings.items())
        ends = ' '.join(f'{end:.3f}' for end in candidate.ends.values())
        shape = "the paper's shape" if candidate.has_shape_of_paper else 'another shape'
        print(f'{candidate.success:.3f} ({ends}), {shape}: {settings}')


if __name__ == '__main__':
    main()
