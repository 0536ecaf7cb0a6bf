"""The demo: a simulated head learns joint attention while you watch."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ja_bringup.course import Course, Stage
from ja_common.core.run_folder import new_run_folder
from ja_runner.graph import with_arguments
from ja_runner.node_spec import NodeSpec
from ja_runner.progress import WINDOW_TRIALS, ProgressNode
from ja_runner.run import check_memory, run_graph
from ja_runner.supervisor import Supervision

if TYPE_CHECKING:
    from ja_sim.core.photo_head_file import PhotoHead

PHOTO_FILE = 'caregiver.npz'


def run_demo(
    graph: Sequence[NodeSpec],
    stages: Sequence[Stage],
    one_process: bool,
    supervision: Supervision,
    arguments: Sequence[str],
    view: bool = False,
    resume: Path | None = None,
    markers: bool = False,
    caregiver: 'PhotoHead | None' = None,
    elsewhere: Sequence[NodeSpec] = (),
    frames: bool = False,
    standard_outputs: bool = False,
) -> int:
    """Lead the graph through the stages of a course and print a summary; return the exit code.

    The code is 0 if a trial was finished, also where a signal has ended the run, and all is saved.
    `resume`: the folder of a run whose learner and gate continue from where they ended.
    `caregiver`: the head of a photograph that plays her; it is saved beside the run's results.
    `elsewhere`: the nodes that run on another machine. The machine with the sim leads the course
    and prints the summary; any other runs its nodes until a signal ends it. Raises ConfigError
    when the folder to resume from holds no checkpoint.
    """
    leads = any(spec.executable == 'sim' for spec in graph)
    if resume is not None:
        check_memory(resume)
    folder = new_run_folder('demo')
    if caregiver is not None:
        graph = with_photo(graph, caregiver, folder)
    course: list[Course] = []

    def over(node: ProgressNode) -> bool:
        if not leads:
            return False
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
        markers=markers,
        frames=frames,
        standard_outputs=standard_outputs,
        supervision=supervision,
        arguments=arguments,
        memory=resume,
        elsewhere=with_arguments(elsewhere, arguments),
    )
    if not leads:
        return code
    lines = summary(progress, stages)
    if progress.curve.records:
        # First: printing may fail as well.
        saved, places = save_curve(progress, folder)
        lines += places
        code = code if saved else 1
    else:
        code = code or 1
    for line in lines:
        print(line)
    return code


def with_photo(graph: Sequence[NodeSpec], head: 'PhotoHead', folder: Path) -> list[NodeSpec]:
    """Save the head of a photograph into a run's folder; return the graph whose sim shows it."""
    from ja_sim.core.photo_head_file import write_photo_head

    photo = write_photo_head(folder.absolute() / PHOTO_FILE, head)
    return [
        replace(spec, parameters={**spec.parameters, 'photo': str(photo)})
        if spec.executable == 'sim'
        else spec
        for spec in graph
    ]


def save_curve(progress: ProgressNode, folder: Path) -> tuple[bool, list[str]]:
    """Write the success curve as CSV and as a picture; return whether, and what to print.

    The rows of a table that cannot be written are printed: nothing else holds them.
    """
    # matplotlib is imported late: before the run it would delay the first node.
    from ja_bringup.success_curve import CurveOrigin, as_csv, draw_png, write_csv

    curve = progress.curve
    origin = CurveOrigin(progress.track, progress.weight_files)
    lines = []
    try:
        lines.append(f'success curve: {write_csv(curve, folder, origin)}')
        lines.append(f'               {draw_png(curve, folder, WINDOW_TRIALS)}')
    except OSError as error:
        table = [] if lines else as_csv(curve, origin).splitlines()
        return False, [*table, *lines, f'error: {error}']
    return True, lines


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
    lines.append(f'chance, one object of {progress.objects}: {1 / progress.objects:.2f}')
    return [*lines, f'track of the learner: {progress.track}'] if progress.track else lines
