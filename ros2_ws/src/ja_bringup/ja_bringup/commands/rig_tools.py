"""The commands `faults` and `soak`, for `./ja`: they test a rig before people rely on it."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the commands to an app."""
    app.command()(faults)
    app.command()(soak)


def faults(
    only: Annotated[
        str, typer.Option(help='Only faults with this in their name: killed, clock, network, ...')
    ] = '',
) -> None:
    """Test every fault on a simulated rig: kill, freeze, cut, delay; print what the head does.

    Exit code 1 if the head did not stop or continue as it must, or if learned trials were lost.
    """
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from ja_diagnostics.faults.hosts import CASES, missing, run_on_hosts
    from ja_diagnostics.faults.run import COLUMNS, FaultOutcome, FaultRun
    from ja_runner.parts import check_installed

    check_installed(['ja_sim'])
    outcomes: list[FaultOutcome] = []
    with TemporaryDirectory() as name:
        folder = Path(name)
        run = FaultRun(folder / 'here', typer.echo)
        if chosen := [fault for fault in run.faults() if only in fault.name]:
            run.run(chosen)
            outcomes += run.outcomes
        if cases := [case for case in CASES if only in case]:
            if why := missing():
                typer.echo(f'left out: {", ".join(cases)}: {why}')
            else:
                outcomes += [run_on_hosts(case, folder / case, typer.echo) for case in cases]
    table = Table(*map(escape, COLUMNS), box=box.MARKDOWN)
    for outcome in outcomes:
        table.add_row(*outcome.row())
    typer.echo()
    Console(width=130, soft_wrap=True).print(table)
    sys.exit(int(not outcomes or not all(outcome.ok for outcome in outcomes)))


def soak(
    context: typer.Context,
    time_s: Annotated[
        float, typer.Option('--time', min=60.0, help='Run for so many seconds; hours are useful.')
    ] = 3600.0,
    camera_rate_hz: Annotated[
        float, typer.Option(min=1.0, max=240.0, help='Images a second of the simulated camera.')
    ] = 15.0,
) -> None:
    """Run the whole graph in real time for long; print what grows, slows down, or is lost."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from ja_common.core.run_folder import new_run_folder
    from ja_common.ros_arguments import parameter_arguments
    from ja_diagnostics.soak import COLUMNS, Soak
    from ja_runner.graph import sim_graph, with_arguments
    from ja_runner.parts import check_installed

    check_installed(['ja_sim'])
    folder = new_run_folder('soak').absolute()
    settings = {
        'lockstep': False,
        'camera_rate_hz': camera_rate_hz,
        'checkpoint_folder': str(folder / 'checkpoints'),
        'trials_file': str(folder / 'trials'),
    }
    arguments = [*parameter_arguments(settings), *(context.obj or [])]
    run = Soak(with_arguments(sim_graph(), arguments), folder, typer.echo)
    code = run.run(time_s)
    table = Table(*map(escape, COLUMNS), box=box.MARKDOWN)
    for series in run.series():
        table.add_row(*series.row())
    Console(width=130, soft_wrap=True).print(table)
    sys.exit(code)
