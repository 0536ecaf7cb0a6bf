"""The main job: a simulated head learns joint attention, before your eyes."""

from collections.abc import Sequence

from ja_bringup.graph import NodeSpec
from ja_bringup.progress import WINDOW_TRIALS, ProgressNode, rate_text
from ja_bringup.report import draw_png, write_csv
from ja_bringup.run import new_run_folder, run_graph
from ja_bringup.supervisor import OnDeath


def run_demo(
    graph: Sequence[NodeSpec],
    trials: int,
    time_s: float,
    one_process: bool,
    on_death: OnDeath,
    arguments: Sequence[str],
) -> int:
    """Run until so many trials or seconds have passed; summary, curve and exit code."""
    folder = new_run_folder('demo')
    code, watcher = run_graph(
        graph,
        folder,
        'Joint attention, simulated head',
        lambda node: len(node.curve.records) >= trials or node.elapsed_s >= time_s,
        one_process=one_process,
        on_death=on_death,
        arguments=arguments,
    )
    for line in summary(watcher):
        print(line)
    if watcher.curve.records:
        print(f'success curve: {write_csv(watcher.curve, folder)}')
        print(f'               {draw_png(watcher.curve, folder, WINDOW_TRIALS)}')
    return code


def summary(watcher: ProgressNode) -> list[str]:
    """The run in a few lines."""
    records = watcher.curve.records
    if not records:
        return ['no trial was finished']
    seconds = max(watcher.elapsed_s, 1e-9)
    first = watcher.curve.rate(slice(WINDOW_TRIALS))
    last = watcher.curve.rate(slice(-WINDOW_TRIALS, None))
    return [
        f'{len(records)} trials in {seconds:.0f} s: {len(records) / seconds:.1f} trials/s, '
        f'{watcher.images / seconds:.0f} images/s',
        f'success rate, first trials: {rate_text(first)} (95 % interval)',
        f'success rate, last trials:  {rate_text(last)}, p(LM) {records[-1].p_lm:.2f}',
    ]
