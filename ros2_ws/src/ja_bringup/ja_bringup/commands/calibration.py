"""The command `calibrate`, for `./ja`."""

import sys
from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the command to an app."""
    app.command()(calibrate)


def calibrate(
    context: typer.Context,
    to: Annotated[Path, typer.Option(help='The YAML file to write.')] = Path('calibration.yaml'),
    patience_s: Annotated[
        float, typer.Option(min=5.0, help='Give up after so many seconds without progress.')
    ] = 30.0,
) -> None:
    """Find focal length, signs, gain, play and camera delay by small turns of the head.

    The head moves slowly by 0.1 rad each way, within the limits of the gate. The command takes
    the place of the gate, so the graph must not run. Ctrl-C brakes, and the head holds.
    """
    from rich.console import Console
    from rich.table import Table

    from ja_calibration.calibration_file import save
    from ja_calibration.run_calibration import run_calibration
    from ja_common.core.config import ConfigError
    from ja_common.core.files import check_file_writable
    from ja_common.ros_arguments import check_ros_arguments

    arguments = context.obj or []
    check_ros_arguments(arguments)
    if not to.absolute().parent.is_dir():
        raise ConfigError(f'{to}: there is no folder {to.absolute().parent}')
    check_file_writable(to)
    try:
        with Console(stderr=True).status('waiting for images and joint states ...') as status:
            contents = run_calibration(arguments, patience_s, status.update)
    except KeyboardInterrupt:
        sys.exit('stopped; the head holds its posture; no file was written')
    except ValueError as error:
        sys.exit(f'error: {error}')
    table = Table('figure', 'value', 'standard error')
    for name, found in contents.items():
        pair = found if isinstance(found, dict) else {'value': found, 'error': ''}
        table.add_row(name, str(pair['value']), str(pair['error']))
    Console().print(table)
    if 'camera_delay_s' not in contents:
        typer.echo('camera_delay_s is left out: its standard error is above 10 ms')
    save(contents, to)
    typer.echo(to)
