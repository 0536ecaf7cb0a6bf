"""The command `meet`, for `./ja`."""

import sys
from pathlib import Path
from typing import Annotated, Optional

import typer

from ja_bringup.commands.options import (
    HungAfter,
    Markers,
    OnDeath,
    OnDeathChoice,
    OneProcess,
    Record,
    Senses,
    Swap,
    View,
)
from ja_runner.graph import RECORDER, meet_graph, replace_nodes, with_arguments
from ja_runner.senses import parse_senses, with_senses
from ja_runner.supervisor import Supervision


def register(app: typer.Typer) -> None:
    """Add the command to an app."""
    app.command()(meet)


def meet(
    context: typer.Context,
    film: Annotated[
        Optional[Path],
        typer.Argument(help='A wide film of a person who follows --schedule, not a camera.'),
    ] = None,
    source: Annotated[
        Optional[str],
        typer.Option(
            help='Webcam or address (rtsp://...), in whose picture a digital head looks around. '
            "Without it, the graph uses the rig's own camera and motors."
        ),
    ] = None,
    schedule: Annotated[
        Optional[Path], typer.Option(help='With a film: when she looks at which thing.')
    ] = None,
    trials: Annotated[
        int, typer.Option(min=1, max=100000, help='End after so many requests.')
    ] = 40,
    pace: Annotated[
        float, typer.Option(min=0.25, max=4.0, help='2 is twice as fast, 0.5 half as fast.')
    ] = 1.0,
    rearrange_every: Annotated[
        int,
        typer.Option(
            min=0,
            max=100000,
            help='Ask her to move the things after so many requests; 0: never. Among things that '
            'never move, nothing can be learned without labels.',
        ),
    ] = 5,
    seed: Annotated[int, typer.Option(min=0, help='Seed of the requests and of the robot.')] = 0,
    offset_s: Annotated[
        float,
        typer.Option(
            '--offset',
            help="With a film: the time in it at which the schedule's time zero is [s].",
        ),
    ] = 0.0,
    view_deg: Annotated[
        Optional[float],
        typer.Option(
            min=10.0,
            max=170.0,
            help='With a film: how wide its camera sees, in degrees; by default as its schedule '
            'states.',
        ),
    ] = None,
    things: Annotated[
        int, typer.Option(min=1, max=20, help='Things in a schedule or rehearsal that is made.')
    ] = 5,
    make_schedule: Annotated[
        Optional[Path],
        typer.Option(
            help='Write a schedule into this folder, with a page that speaks it and its beeps '
            '(WAV), to follow while you film yourself.'
        ),
    ] = None,
    rehearse: Annotated[
        Optional[Path],
        typer.Option(
            help='Write a film (.mp4 or .avi) of the simulated caregiver, and its schedule.'
        ),
    ] = None,
    stills: Annotated[
        Optional[Path],
        typer.Option(
            help='Let the learner alone learn from the pictures of this folder, whose names or '
            'table state where each face looks, and print how often it is right.'
        ),
    ] = None,
    resume: Annotated[
        Optional[Path],
        typer.Option(help='Go on with what the learner of the run in this folder knows.'),
    ] = None,
    senses: Senses = '',
    swap: Swap = None,
    record: Record = False,
    one_process: OneProcess = False,
    view: View = True,
    markers: Markers = False,
    on_death: OnDeath = OnDeathChoice.stop,
    hung_after_s: HungAfter = Supervision.hung_after_s,
) -> None:
    """Be the caregiver: the page asks you to look at things, and the head learns to follow.

    It ends after the trials, on the page, or with Ctrl-C, and leaves a report in runs/. Exit
    code 0: at least one request was answered; 1: none was, or a node died, or the report could
    not be written; 2: a setting cannot be used.
    """
    if any(each is not None for each in (make_schedule, rehearse, stills)):
        alone = [film, source, schedule, make_schedule, rehearse, stills]
        if sum(each is not None for each in alone) > 1:
            raise typer.BadParameter('--make-schedule, --rehearse and --stills each stand alone')
        if stills is not None:
            from ja_benchmarks.stills import score_stills

            score_stills(stills, seed, 'eyes' in parse_senses(senses))
        else:
            _prepare_film(make_schedule, rehearse, seed, trials, things, pace, rearrange_every)
        return
    from ja_bringup.meet import run_meeting, source_kind
    from ja_common.core.run_folder import new_run_folder
    from ja_runner.run import check_memory

    arguments = context.obj or []
    supervision = Supervision(on_death.value, hung_after_s)
    chosen = parse_senses(senses)
    if film is not None:
        if source is not None:
            raise typer.BadParameter('a film takes the place of --source: give one of the two')
        if schedule is None:
            raise typer.BadParameter('a film needs --schedule, which states where she looks when')
        from ja_bringup.meet_film import run_film_meeting

        sys.exit(
            run_film_meeting(
                film,
                schedule,
                seed=seed,
                offset_s=offset_s,
                view_deg=view_deg,
                senses=chosen,
                swap=swap or (),
                record=record,
                one_process=one_process,
                view=view,
                markers=markers,
                supervision=supervision,
                arguments=arguments,
                resume=resume,
            )
        )
    if schedule is not None:
        raise typer.BadParameter('--schedule is for a film: ./ja meet FILM --schedule FILE')
    if resume is not None:
        check_memory(resume)
    folder = new_run_folder('meet').absolute()
    scorer = {
        'folder': str(folder),
        'source': source_kind(source),
        'trials': trials,
        'rearrange_every': rearrange_every,
        'learner': 'gaze_line',
    }
    graph = replace_nodes(with_senses(meet_graph(source, seed, pace, scorer), chosen), swap or ())
    sys.exit(
        run_meeting(
            with_arguments([*[RECORDER] * record, *graph], arguments),
            folder,
            one_process=one_process,
            view=view,
            markers=markers,
            supervision=supervision,
            arguments=arguments,
            resume=resume,
        )
    )


def _prepare_film(
    folder: Path | None,
    film: Path | None,
    seed: int,
    trials: int,
    things: int,
    pace: float,
    rearrange_every: int,
) -> None:
    """Write a spoken schedule into a folder, or the film of a rehearsal."""
    from ja_bringup.meet_film import REHEARSAL_HANDS_S, write_rehearsal, write_spoken_schedule
    from ja_caregiver.core.schedule import make_schedule

    if folder is not None:
        plan = make_schedule(seed, trials, things, pace, rearrange_every)
        for path in write_spoken_schedule(plan, folder):
            print(path)
    if film is not None:
        plan = make_schedule(seed, trials, things, pace, rearrange_every, REHEARSAL_HANDS_S)
        written = write_rehearsal(plan, film, seed)
        print(f'./ja meet {film} --schedule {written}')
