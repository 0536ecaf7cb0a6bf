"""How a command ends: its exit code, and one sentence for an error that a person can correct."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from ja_common.core.config import ConfigError
from ja_common.core.files import SaveError


@contextmanager
def clean_end() -> Iterator[None]:
    """Turn what a command raises into a sentence and an exit code.

    2: a configuration that cannot be used. 1: a file, or the command's own output, cannot be
    read or written. If the reader of the output has gone (`| head -1`), no sentence is printed.
    """
    try:
        try:
            yield
        finally:
            sys.stdout.flush()  # here and not at exit, where an error is a traceback
    except ConfigError as error:
        _end(2, str(error))
    except BrokenPipeError:
        _end(1, '')
    except OSError as error:
        _end(1, _sentence(error))


def _sentence(error: OSError) -> str:
    if isinstance(error, SaveError) or error.errno is None:
        return str(error)
    if error.filename is None:
        return f'the output cannot be written ({error.strerror})'
    return f'{error.filename}: {error.strerror}'


def _end(code: int, sentence: str) -> None:
    with suppress(OSError):
        if sentence:
            print(f'error: {sentence}', file=sys.stderr, flush=True)
    with suppress(OSError, ValueError):
        # What Python still holds of the output can go nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)
