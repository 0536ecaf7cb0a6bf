"""The main job: a simulated head learns joint attention, before your eyes."""

from collections.abc import Sequence
from pathlib import Path

from ja_bringup.course import Course, Stage
from ja_runner.node_spec import NodeSpec
from ja_runner.progress import WINDOW_TRIALS, ProgressNode
from ja_runner.run import check_memory, new_run_folder, run_graph
from ja_runner.supervisor import OnDeath


def run_demo(
    graph: Sequence[NodeSpec],
    stages: Sequence[Stage],
    one_process: bool,
    on_death: OnDeath,
    arguments: Sequence[str],
    view: bool = False,
    resume: Path | None = None,
) -> int:
    """Lead the graph through the stages of a course; summary, curve and exit code.

    `resume`: the folder of a run, in which learner and gate go on where they were; ConfigError
    when it holds nothing to go on from.
    """
    if resume is not None:
        check_memory(resume)
    folder = new_run_folder('demo')
    course: list[Course] = []

    def over(node: ProgressNode) -> bool:
        if not course:
            course.append(Course(node, stages))
        return course[0].tick()

    code, watcher = run_graph(
        graph,
        folder,
        'Joint attention, simulated head',
        over,
        one_process=one_process,
        view=view,
        on_death=on_death,
        arguments=arguments,
        memory=resume,
    )
    for line in summary(watcher, stages):
        print(line)
    if watcher.curve.records:
        # matplotlib only now: before the run it would keep the first node waiting.
        from ja_bringup.success_curve import draw_png, write_csv

        print(f'success curve: {write_csv(watcher.curve, folder)}')
        print(f'               {draw_png(watcher.curve, folder, WINDOW_TRIALS)}')
    return code


def summary(watcher: ProgressNode, stages: Sequence[Stage]) -> list[str]:
    """The run in a few lines."""
    curve = watcher.curve
    if not curve.records:
        return ['no trial was finished']
    seconds = max(watcher.elapsed_s, 1e-9)
    lines = [
        f'{len(curve.records)} trials in {seconds:.0f} s: {len(curve.records) / seconds:.1f} '
        f'trials/s, {watcher.images / seconds:.0f} images/s'
    ]
    for stage in stages:
        if stage.learner_alone:
            parts = {f'{stage.name}, learner alone': slice(None)}
        else:
            parts = {
                f'{stage.name}, first trials': slice(WINDOW_TRIALS),
                f'{stage.name}, last trials': slice(-WINDOW_TRIALS, None),
            }
        lines += [
            f'success, {name + ":":28} {curve.rate(part, stage.name)}'
            for name, part in parts.items()
        ]
    return [*lines, f'chance, one object of {watcher.objects}: {1 / watcher.objects:.2f}']
