"""The text of `--help` of a node's executable: what it is, how to start it, its parameters."""

import importlib
from pathlib import Path

from ja_common.core.parameter_page import parameter_page

_USAGE = """usage: {name} [--ros-args [-p NAME:=VALUE ...] [--params-file FILE] [-r FROM:=TO ...]]

{purpose}

  -p NAME:=VALUE        set a parameter
  --params-file FILE    set the parameters of this file (section /**/{name}: or /**:)
  -r FROM:=TO           rename a topic; -r __ns:=/NAME puts all names below /NAME
  --log-level LEVEL     debug, info, warn or error
"""


def node_usage(module: str) -> str:
    """Return the usage of the executable of a node's module, `ja_control.gate_node`.

    The parameters are those of the project's page of parameters; a node that is not on it shows
    none.
    """
    loaded = importlib.import_module(module)
    # Started with `python -m`, the module is called __main__, and its file has the name.
    name = Path(loaded.__file__ or module).stem.removesuffix('_node')
    purpose = (loaded.__doc__ or name).partition('\n')[0]
    lines = [_USAGE.format(name=name, purpose=purpose)]
    if rows := parameter_page().get(name):
        lines.append('parameters (default; range):')
        for row in rows:
            shown = '; '.join(part for part in (row.default, row.range) if part)
            lines += [f'  {row.name} ({shown})', f'      {row.text.replace("*", "")}']
    else:
        lines.append(f'`ros2 param list /{name}` shows its parameters while it runs.')
    return '\n'.join(lines)
