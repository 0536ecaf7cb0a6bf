"""The commands `bench` and `reference`, for `./ja`."""

import sys
from pathlib import Path
from typing import Annotated, Optional

import typer


def register(app: typer.Typer) -> None:
    """Add the commands to an app."""
    app.command()(bench)
    app.command()(reference)


def _benchmark_names() -> list[str]:
    from ja_benchmarks.run_benchmarks import benchmarks

    return list(benchmarks())


def bench(
    name: Annotated[
        Optional[str],
        typer.Argument(help='Which benchmark; all without it.', autocompletion=_benchmark_names),
    ] = None,
    json_file: Annotated[
        Optional[Path], typer.Option('--json', help='Write the figures to this file.')
    ] = None,
    quick: Annotated[
        bool, typer.Option('--quick', help='The quick form, where a benchmark has one.')
    ] = False,
) -> None:
    """Measure: a table of figures, each with its unit, count and interval."""
    from ja_benchmarks.run_benchmarks import run_benchmarks

    sys.exit(run_benchmarks(name, json_file, quick))


def reference(
    folder: Annotated[Path, typer.Option(help='Folder of the pages.')] = Path('docs'),
) -> None:
    """Write topics.md and parameters.md from the running code; a copy is for `gate --help`."""
    from rich.console import Console

    from ja_bringup.reference import copy_into_package, write_reference

    with Console(stderr=True).status('starting every node ...'):
        pages = [*write_reference(folder), copy_into_package(folder)]
    for page in pages:
        typer.echo(page)
