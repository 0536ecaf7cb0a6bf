"""Compile with Numba: machine code that the next process finds, where it can be stored."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from numba import njit


def compiled(function: Callable[..., Any]) -> Any:
    """Return the function as compiled code that runs without the interpreter's lock.

    The code is cached on disk. Without a folder for the cache, or without room in it, the function
    works all the same: Numba alone would refuse the first, and lose the call at the second.
    """
    try:
        dispatcher = njit(nogil=True, cache=True)(function)
    except RuntimeError:  # no folder can be written: neither that of the module nor the user's
        return njit(nogil=True)(function)
    save = dispatcher._cache.save_overload

    def save_where_possible(signature: Any, code: Any) -> None:
        with suppress(OSError):
            save(signature, code)

    dispatcher._cache.save_overload = save_where_possible
    return dispatcher
