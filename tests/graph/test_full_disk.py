"""Trials go on while nothing can be saved; all are saved when the disk has room again."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from rclpy.context import Context

from ja_learning.core.checkpoint import load_checkpoint
from ja_runner.graph import sim_graph
from ja_runner.node_spec import NodeSpec
from ja_runner.one_process import run_in_one_process
from ja_runner.progress import ProgressNode
from ros_testing import PATIENCE_S

MORE_TRIALS = 5

pytestmark = pytest.mark.usefixtures('domain')


def graph(folder: Path) -> list[NodeSpec]:
    """Return the graph of the demo in lockstep, which saves into a folder after each trial."""
    small = {'image_width': 160, 'image_height': 120}
    saved = {
        'learning_module': {
            'checkpoint_folder': str(folder / 'checkpoints'),
            'checkpoint_every_trials': 1,
        },
        'gate': {'trials_file': str(folder / 'trials')},
        'scorer': {'csv_file': str(folder / 'trials.csv')},
    }
    return [
        replace(node, parameters={**node.parameters, **saved.get(node.executable, {})})
        for node in sim_graph(seed=1, sim_parameters=small)
    ]


def test_trials_go_on_without_a_disk_and_none_is_lost(tmp_path):
    folder, away = tmp_path / 'kept', tmp_path / 'away'
    progress: list[ProgressNode] = []
    learned: list[int] = []

    def make_progress(context: Context) -> ProgressNode:
        progress.append(ProgressNode(context=context))
        return progress[0]

    def trials() -> int:
        return int(progress[0].gate.get('trials', '0'))

    def lose_the_disk_and_get_it_back() -> Iterator[None]:
        yield from until(lambda: list(folder.glob('checkpoints/*-*.npz')) and count() > 0)
        folder.rename(away)  # a folder that vanished, and cannot be made again
        folder.write_text('a file in the place of the folder')
        learned.append(trials_learned(away))
        before = trials()
        yield from until(lambda: trials() >= before + MORE_TRIALS)
        for node in ('/gate', '/learning_module', '/scorer'):
            yield from until(
                lambda node=node: f'{folder} is no folder' in progress[0].warnings.get(node, '')
            )
        folder.unlink()
        away.rename(folder)
        # From here on trials need not end: what waits is saved all the same.
        yield from until(lambda: count() > before)
        for node in ('/gate', '/learning_module', '/scorer'):
            yield from until(
                lambda node=node: 'no folder' not in progress[0].warnings.get(node, '')
            )

    def count() -> int:
        path = folder / 'trials'
        return int(path.read_text()) if path.exists() else 0

    steps = lose_the_disk_and_get_it_back()
    said: list[str] = []
    code = run_in_one_process(
        graph(folder), make_progress, lambda: next(steps, 'over') == 'over', said.append
    )
    assert code == 0, said
    assert count() == trials()
    assert trials_learned(folder) >= learned[0] + MORE_TRIALS - 1
    rows = (folder / 'trials.csv').read_text().splitlines()[1:]
    assert len({row.split(',')[0] for row in rows}) == len(rows)
    assert len(rows) == len(progress[0].curve.records)
    assert not list(folder.rglob('.*.npz.*'))


def trials_learned(folder: Path) -> int:
    return load_checkpoint(max(folder.glob('checkpoints/*-*.npz')))[1]['trials']


def until(condition: Callable[[], object]) -> Iterator[None]:
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, 'the graph stands still'
        yield
