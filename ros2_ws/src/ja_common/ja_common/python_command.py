"""Commands that start Python, which then imports nothing from the current folder.

`python -m` and `python -c` search the current folder before any package: a file of the name
`numpy.py` in a downloaded folder would run in every process that is started there. What PYTHONPATH
names is searched as ever.
"""

import os
import sys
from collections.abc import MutableMapping

_HAS_P_OPTION = hasattr(sys.flags, 'safe_path')  # from 3.11 on
# For Python 3.10. `sys` is built in: this import searches no folder.
_LEAVE_CURRENT_FOLDER = "import sys; sys.path[:1] == [''] and sys.path.pop(0)\n"
_RUN_MODULE = (
    'import runpy; del sys.argv[0]\n'
    "runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)"
)


def module_command(module: str, *arguments: str) -> list[str]:
    """Return the command line of a module, as `python -m` runs it."""
    if _HAS_P_OPTION:
        return [sys.executable, '-P', '-m', module, *arguments]
    return code_command(_RUN_MODULE, module, *arguments)


def code_command(code: str, *arguments: str) -> list[str]:
    """Return the command line of a piece of code, as `python -c` runs it."""
    return [sys.executable, '-c', f'{_LEAVE_CURRENT_FOLDER}{code}', *arguments]


def protect_children(environ: MutableMapping[str, str] = os.environ) -> None:
    """Let every Python that this process starts ignore the current folder (from 3.11 on).

    This reaches the processes that libraries start: workers of Dask and of multiprocessing. An
    empty entry of PYTHONPATH (as `PYTHONPATH=$PYTHONPATH:/mine` makes it) means the current
    folder, too, and is left out.
    """
    environ['PYTHONSAFEPATH'] = '1'
    if 'PYTHONPATH' in environ:
        folders = environ['PYTHONPATH'].split(os.pathsep)
        environ['PYTHONPATH'] = os.pathsep.join(filter(None, folders))
