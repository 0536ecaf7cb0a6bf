"""The command `demo`, for `./ja`."""

import sys
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from ja_bringup.commands.options import (
    Frames,
    HungAfter,
    Markers,
    OnDeath,
    OnDeathChoice,
    OneProcess,
    Only,
    Record,
    Senses,
    StandardOutputs,
    Swap,
    View,
    Without,
)
from ja_runner.graph import RECORDER, part_of_graph, replace_nodes, sim_graph, with_arguments
from ja_runner.senses import parse_senses, with_senses
from ja_runner.supervisor import Supervision

if TYPE_CHECKING:
    from ja_sim.core.photo_head_file import PhotoHead


class DemoLearner(str, Enum):
    """The learner of the demo."""

    gaze_line = 'gaze_line'
    paper = 'paper'


# Five objects around the caregiver; or three, all in the first view, for the paper's network,
# which needs thousands of trials.
SCENE = {'gaze_line': 'default', 'paper': 'easy'}
PRACTICE_TRIALS = {'gaze_line': 300, 'paper': 2000}


def register(app: typer.Typer) -> None:
    """Add the command to an app."""
    app.command()(demo)


def demo(
    context: typer.Context,
    learner: Annotated[
        DemoLearner, typer.Option(help="The fast learner, or the paper's network.")
    ] = DemoLearner.gaze_line,
    trials: Annotated[
        Optional[int],
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
        Optional[str],
        typer.Option(
            help=f'Scene of the sim, by name or file; by default {SCENE["gaze_line"]}, or with '
            f"the paper's learner {SCENE['paper']}."
        ),
    ] = None,
    caregiver: Annotated[
        Optional[Path],
        typer.Option(
            help='A photograph of a person who looks at the camera, you for example: this face '
            'plays the caregiver. Or a file that was made of one (.npz).'
        ),
    ] = None,
    draw_ahead: Annotated[
        bool,
        typer.Option(
            '--draw-ahead',
            help='Draw the next picture while the nodes process the last one: more images a '
            'second, but each command takes effect one picture later.',
        ),
    ] = False,
    resume: Annotated[
        Optional[Path],
        typer.Option(help='Resume the run in this folder, with all that it learned.'),
    ] = None,
    senses: Senses = '',
    only: Only = '',
    without: Without = '',
    swap: Swap = None,
    record: Record = False,
    one_process: OneProcess = False,
    view: View = True,
    markers: Markers = False,
    frames: Frames = False,
    standard_outputs: StandardOutputs = False,
    on_death: OnDeath = OnDeathChoice.stop,
    hung_after_s: HungAfter = Supervision.hung_after_s,
) -> None:
    """Watch the simulated head learn to follow the caregiver's gaze.

    Ctrl-C ends it in order. Exit code 0: at least one trial was finished; 1: none was, or a node
    died, or the success curve could not be written; 2: a setting cannot be used.
    """
    from ja_bringup.course import standard_course
    from ja_bringup.demo import run_demo

    arguments = context.obj or []
    sim = {'scene': scene or SCENE[learner.value], 'draw_ahead': draw_ahead}
    graph = with_senses(sim_graph(seed, sim, learner.value), parse_senses(senses))
    graph, elsewhere = part_of_graph(graph, only, without)
    graph = replace_nodes(graph, swap or ())
    stages = standard_course(trials or PRACTICE_TRIALS[learner.value], time_s, exam_trials)
    graph = with_arguments([*[RECORDER] * record, *graph], arguments)
    supervision = Supervision(on_death.value, hung_after_s)
    head = None if caregiver is None else _head_of(caregiver)
    sys.exit(
        run_demo(
            graph,
            stages,
            one_process,
            supervision,
            arguments,
            view,
            resume,
            markers,
            head,
            elsewhere,
            frames,
            standard_outputs,
        )
    )


def _head_of(photo: Path) -> 'PhotoHead':
    """Return the head of a photograph, or of the file that was made of one; raise ConfigError."""
    from ja_caregiver.core.photo_face import PhotoFaceFinder
    from ja_caregiver.core.photo_head import photo_head
    from ja_sim.core.photo_head_file import read_photo_head

    if photo.suffix == '.npz':
        return read_photo_head(photo)
    return photo_head(PhotoFaceFinder().read_photo(photo))
