"""`./ja COMMAND`: the commands of the system."""

import sys
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from ja_benchmarks.run_benchmarks import benchmarks
from ja_bringup.commands.calibration import register as register_calibration
from ja_bringup.commands.diagnostics import register as register_inspection
from ja_bringup.commands.experiments import register as register_experiments
from ja_bringup.commands.recording import register as register_recording
from ja_bringup.commands.rig_tools import register as register_rig_tools
from ja_bringup.examples import show_examples
from ja_common.core.config import ConfigError
from ja_common.ros_arguments import split_ros_arguments
from ja_common.ros_defaults import apply_ros_defaults
from ja_runner.graph import RECORDER, replace_nodes, rig_graph, sim_graph, with_arguments

app = typer.Typer(
    help='A camera head that learns joint attention, on ROS 2. ROS arguments go behind '
    '`--ros-args`, as for any node: -r, -p, --params-file, __ns.',
    epilog='`./ja COMMAND --help` shows examples. The tests: `./ja test`, which takes the '
    'arguments of pytest.',
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


class OnDeathChoice(str, Enum):
    """What happens when a node dies."""

    stop = 'stop'
    restart = 'restart'


class LearnerChoice(str, Enum):
    """Who learns in the demo."""

    gaze_line = 'gaze_line'
    paper = 'paper'


SCENE = {'gaze_line': 'default', 'paper': 'easy'}
"""Five objects around the caregiver; or three, all in the first view, for who needs thousands."""

PRACTICE_TRIALS = {'gaze_line': 300, 'paper': 2000}

OnDeathOption = Annotated[OnDeathChoice, typer.Option(help='What to do when a node dies.')]
OneProcess = Annotated[bool, typer.Option('--one-process', help='All nodes in one process.')]
Record = Annotated[bool, typer.Option('--record', help='Record all topics into runs/.')]
View = Annotated[bool, typer.Option(help='Serve the live page, and print its address.')]
Swap = Annotated[
    list[str] | None,
    typer.Option(help='A node of yours for one of ours: gate=my_lab/my_gate. Several times.'),
]
TimeOption = Annotated[float, typer.Option('--time', min=0.0, help='End after so many seconds.')]


@app.command()
def demo(
    context: typer.Context,
    learner: Annotated[
        LearnerChoice, typer.Option(help="The fast learner, or the paper's network.")
    ] = LearnerChoice.gaze_line,
    trials: Annotated[
        int | None,
        typer.Option(
            min=1,
            help=f'Practise for so many trials; {PRACTICE_TRIALS["gaze_line"]} by default, '
            f"{PRACTICE_TRIALS['paper']} with the paper's learner.",
        ),
    ] = None,
    time_s: Annotated[
        float, typer.Option('--time', min=0.0, help='Practise for so many seconds at most.')
    ] = 120.0,
    exam_trials: Annotated[
        int,
        typer.Option('--exam', min=0, help='Trials of the learner alone at the end; 0: no exams.'),
    ] = 100,
    seed: Annotated[int, typer.Option(min=0, help='Seed of the world and of the robot.')] = 0,
    scene: Annotated[
        str | None,
        typer.Option(
            help=f'Scene of the sim, by name or file; by default {SCENE["gaze_line"]}, or with '
            f"the paper's learner {SCENE['paper']}."
        ),
    ] = None,
    draw_ahead: Annotated[
        bool,
        typer.Option(
            '--draw-ahead',
            help='Draw a picture while the last is judged: more images a second, each of a head '
            'that answers one later.',
        ),
    ] = False,
    resume: Annotated[
        Path | None, typer.Option(help='Go on from what was learned in this run, in its folder.')
    ] = None,
    swap: Swap = None,
    record: Record = False,
    one_process: OneProcess = False,
    view: View = True,
    on_death: OnDeathOption = OnDeathChoice.stop,
) -> None:
    """Watch the simulated head learn to follow the caregiver's gaze."""
    from ja_bringup.course import standard_course
    from ja_bringup.demo import run_demo

    scene = scene or SCENE[learner.value]
    sim = {'scene': scene, 'draw_ahead': draw_ahead}
    graph = replace_nodes(sim_graph(seed, sim, learner.value), swap or ())
    stages = standard_course(trials or PRACTICE_TRIALS[learner.value], time_s, exam_trials)
    graph = with_arguments([*[RECORDER] * record, *graph], context.obj or [])
    sys.exit(run_demo(graph, stages, one_process, on_death.value, context.obj or [], view, resume))


@app.command()
def rig(
    context: typer.Context,
    source: Annotated[
        str | None,
        typer.Option(
            help='Webcam device, video file or image folder, in which a digital head looks '
            "around. Without it, the rig's own drivers are heard."
        ),
    ] = None,
    time_s: TimeOption = 0.0,
    swap: Swap = None,
    record: Record = False,
    one_process: OneProcess = False,
    view: View = True,
    on_death: OnDeathOption = OnDeathChoice.stop,
) -> None:
    """Run the same graph on real pictures: a digital head in them, or a rig's own motors."""
    from ja_runner.run import new_run_folder, run_graph

    arguments = context.obj or []
    code, _ = run_graph(
        with_arguments(
            [*[RECORDER] * record, *replace_nodes(rig_graph(source), swap or ())], arguments
        ),
        new_run_folder('rig'),
        'Joint attention, on real pictures',
        lambda node: 0.0 < time_s < node.elapsed_s,
        one_process=one_process,
        view=view,
        on_death=on_death.value,
        arguments=arguments,
    )
    sys.exit(code)


@app.command()
def bench(
    name: Annotated[
        str | None,
        typer.Argument(
            help='Which one; all of them without it.',
            autocompletion=lambda: list(benchmarks()),
        ),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option('--json', help='Write the figures to this file.')
    ] = None,
) -> None:
    """Measure: a table of figures, each with its unit, count and interval."""
    from ja_benchmarks.run_benchmarks import run_benchmarks

    sys.exit(run_benchmarks(name, json_file))


@app.command()
def reference(
    folder: Annotated[Path, typer.Option(help='Where the pages go.')] = Path('docs'),
) -> None:
    """Write topics.md and parameters.md from the running code."""
    from rich.console import Console

    from ja_bringup.reference import write_reference

    with Console(stderr=True).status('asking every node ...'):
        pages = write_reference(folder)
    for page in pages:
        typer.echo(page)


register_experiments(app)
register_recording(app)
register_inspection(app)
register_rig_tools(app)
register_calibration(app)
show_examples(app)


def main() -> None:
    """Split ROS's arguments off, as rclpy does, and run the command."""
    apply_ros_defaults()
    ours, ros = split_ros_arguments(sys.argv[1:])
    try:
        app(args=ours, obj=ros, prog_name='ja')
    except ConfigError as error:
        sys.exit(f'error: {error}')


if __name__ == '__main__':
    main()
