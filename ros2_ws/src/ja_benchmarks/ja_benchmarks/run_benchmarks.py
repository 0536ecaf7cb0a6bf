"""Run the benchmarks: `./ja bench [NAME] [--quick] [--json FILE]`.

A benchmark is a module in the folder below, with `run() -> {figure: row}`; its name is the
module's. One with a quick form, of a few minutes, has `run(quick: bool = False)`. A row is
`{'value', 'unit', 'n', 'interval'}`: n samples, and the 95 % interval of the value ([low, high],
or None where it has no meaning).
"""

import importlib
import inspect
import json
import pkgutil
from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ja_benchmarks.rows import Row
from ja_common.core.config import ConfigError
from ja_common.core.files import SaveError, check_file_writable, write_file

FOLDER = 'ja_benchmarks.benchmarks'


def benchmarks() -> dict[str, str]:
    """Return the names and modules of all installed benchmarks."""
    package = importlib.import_module(FOLDER)
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    return {name: f'{FOLDER}.{name}' for name in names}


def run_benchmarks(name: str | None, json_file: Path | None, quick: bool = False) -> int:
    """Run one or all: tables on the terminal, figures to `json_file`; return the exit code.

    `quick`: the quick form of one, or of all that have one. Raises ConfigError for an unknown
    name, one without a quick form, or a file that cannot be written, and SaveError when it no
    longer can at the end.
    """
    known = benchmarks()
    if name is not None and name not in known:
        raise ConfigError(f'no benchmark {name!r}; there are: {", ".join(known)}')
    chosen = [name] if name else list(known)
    if quick:
        with_form = [each for each in known if _has_quick_form(known[each])]
        if name and name not in with_form:
            raise ConfigError(f'{name} has no quick form; these have one: {", ".join(with_form)}')
        chosen = [each for each in chosen if each in with_form]
    if json_file is not None and not json_file.absolute().parent.is_dir():
        raise ConfigError(f'{json_file}: there is no folder {json_file.absolute().parent}')
    if json_file is not None:
        check_file_writable(json_file)
    failure: SaveError | None = None
    figures: dict[str, Row] = {}
    for each in chosen:
        # Figures of the quick form are never taken for those of the whole.
        title = f'{each} --quick' if quick else each
        with Console(stderr=True).status(f'bench {title} ...'):
            run = importlib.import_module(known[each]).run
            rows = run(quick=True) if quick else run()
        Console().print(table_of(title, rows))
        figures |= {f'{title}/{figure}': row for figure, row in rows.items()}
        if json_file is not None:
            # After each benchmark, so that an interrupted run keeps its figures.
            failure = _write(json_file, figures)
    if failure is not None:
        raise failure  # only now: the tables of all benchmarks are on the terminal
    return 0


def _has_quick_form(module: str) -> bool:
    return 'quick' in inspect.signature(importlib.import_module(module).run).parameters


def _write(json_file: Path, figures: Mapping[str, Row]) -> SaveError | None:
    """Write all figures; return why they could not be written."""
    try:
        write_file(json_file, json.dumps(figures, indent=2) + '\n')
    except SaveError as error:
        return error
    return None


def table_of(name: str, rows: Mapping[str, Row]) -> Table:
    """Return the table of figures of one benchmark."""
    table = Table(title=f'bench {name}', title_justify='left')
    for column in ('figure', 'value', '95 % interval', 'unit', 'n'):
        table.add_column(column, justify='left' if column in ('figure', 'unit') else 'right')
    for figure, row in rows.items():
        interval = row['interval']
        between = '' if interval is None else f'{interval[0]:.4g} - {interval[1]:.4g}'
        table.add_row(figure, f'{row["value"]:.4g}', between, row['unit'], str(row['n']))
    return table
