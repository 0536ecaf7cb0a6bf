"""The demo: a simulated head learns joint attention while you watch."""

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
    """Lead the graph through the stages of a course and print a summary; return the exit code.

    `resume`: the folder of a run whose learner and gate continue from where they ended. Raises
    ConfigError when that folder holds no checkpoint.
    """
    if resume is not None:
        check_memory(resume)
    folder = new_run_folder('demo')
    course: list[Course] = []

    def over(node: ProgressNode) -> bool:
        if not course:
            course.append(Course(node, stages))
        return course[0].tick()

    code, progress = run_graph(
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
    for line in summary(progress, stages):
        print(line)
    if progress.curve.records:
        # matplotlib is imported late: before the run it would delay the first node.
        from ja_bringup.success_curve import draw_png, write_csv

        print(f'success curve: {write_csv(progress.curve, folder)}')
        print(f'               {draw_png(progress.curve, folder, WINDOW_TRIALS)}')
    return code


def summary(progress: ProgressNode, stages: Sequence[Stage]) -> list[str]:
    """Summarise the run in a few lines."""
    curve = progress.curve
    if not curve.records:
        return ['no trial was finished']
    seconds = max(progress.elapsed_s, 1e-9)
    lines = [
        f'{len(curve.records)} trials in {seconds:.0f} s: {len(curve.records) / seconds:.1f} '
        f'trials/s, {progress.images / seconds:.0f} images/s'
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
    return [*lines, f'chance, one object of {progress.objects}: {1 / progress.objects:.2f}']
