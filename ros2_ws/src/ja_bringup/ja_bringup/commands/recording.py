"""The commands `record`, `replay` and `export`, for `./ja`."""

import sys
from pathlib import Path
from typing import Annotated, Optional

import typer

from ja_recording.core.default_exclude import DEFAULT_EXCLUDE

_RECORDING = 'A .mcap or .db3 file, compressed or not, or the folder of one recording.'


def register(app: typer.Typer) -> None:
    """Add the commands to an app."""
    app.command()(record)
    app.command()(replay)
    app.command()(export)


def record(
    context: typer.Context,
    output: Annotated[
        Optional[Path],
        typer.Option(help='Folder of the recording; runs/<time>-record without it.'),
    ] = None,
    exclude: Annotated[
        str, typer.Option(help='Regular expression: topics that it matches are left out.')
    ] = DEFAULT_EXCLUDE,
    time_s: Annotated[
        float, typer.Option('--time', min=0.0, help='End after so many seconds; 0: no end.')
    ] = 0.0,
    keep_mb: Annotated[
        float, typer.Option(min=0.0, help='Drop the oldest files beyond so many MB; 0: keep all.')
    ] = 4000.0,
    keep_s: Annotated[
        float, typer.Option(min=0.0, help='Drop files older than so many seconds; 0: keep all.')
    ] = 0.0,
) -> None:
    """Record every topic of the running graph, of any type, as MCAP."""
    from ja_bringup.record_and_replay import record as run
    from ja_common.core.files import check_writable

    if output is not None:
        check_writable(output)
    parameters = {
        'folder': '' if output is None else str(output),
        'exclude': exclude,
        'keep_mb': keep_mb,
        'keep_s': keep_s,
    }
    sys.exit(run(parameters, time_s, context.obj or []))


def replay(
    context: typer.Context,
    recording: Annotated[Path, typer.Argument(help=_RECORDING)],
    speed: Annotated[
        float, typer.Option(min=0.001, max=1000.0, help='Recorded seconds per second.')
    ] = 1.0,
    without: Annotated[
        Optional[list[str]], typer.Option(help='A topic to leave out; may be given several times.')
    ] = None,
    score: Annotated[
        bool, typer.Option('--score', help='Publish nothing: train a learner and print its curve.')
    ] = False,
    csv_file: Annotated[
        Optional[Path],
        typer.Option('--csv', help='With --score: write one row for each trial into this file.'),
    ] = None,
    as_json: Annotated[bool, typer.Option('--json', help='With --score: print JSON.')] = False,
) -> None:
    """Publish a recording again, with /clock, to try a node on it."""
    from ja_bringup.record_and_replay import replay as run

    if score:
        from ja_bringup.recorded_trials import score as run_score

        if speed != 1.0:
            raise typer.BadParameter('--speed is for a replay: --score goes as fast as it can')
        sys.exit(run_score(recording, without or (), csv_file, as_json, context.obj or []))
    if csv_file is not None or as_json:
        raise typer.BadParameter('--csv and --json are for --score')

    parameters = {
        'recording': str(recording),
        'speed': speed,
        'without': ','.join(without or ()),
    }
    sys.exit(run(parameters, context.obj or []))


def export(
    context: typer.Context,
    recordings: Annotated[list[Path], typer.Argument(help=f'{_RECORDING} Several may be given.')],
    to: Annotated[Path, typer.Option('--to', help='Folder of the data set; it is created.')],
    licence: Annotated[
        str, typer.Option(help='The licence that the card of the data set names.')
    ] = '',
) -> None:
    """Turn recordings into a data set of trials: a Parquet table, PNG faces, and a card."""
    from ja_bringup.recorded_trials import export as run

    sys.exit(run(recordings, to, licence, context.obj or []))
