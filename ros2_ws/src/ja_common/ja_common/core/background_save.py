"""Save in a thread of its own, and again until it succeeds: no answer waits for a disk."""

import threading
from collections.abc import Callable

RETRY_S = 1.0
"""After this time [s] a failed save is tried again."""

_CLOSING_S = 2.0


class BackgroundSave:
    """Calls `save` in another thread after each request, and again until it raises nothing.

    Requests that come while it runs lead to one further call, so `save` saves what is newest.
    `error` is why the last call failed; None when what was requested is saved, or not yet tried.
    """

    def __init__(self, save: Callable[[], None], retry_s: float = RETRY_S) -> None:
        self._save = save
        self._retry_s = retry_s
        self._changed = threading.Condition()
        self._pending = False
        self._closing = False
        self.error: Exception | None = None
        # A daemon: a disk that does not answer must not keep the process from ending.
        self._thread = threading.Thread(target=self._run, name='save', daemon=True)
        self._thread.start()

    def request(self) -> None:
        """Ask for a call of `save`; return at once."""
        with self._changed:
            self._pending = True
            self._changed.notify()

    def close(self) -> None:
        """Save what is not saved yet, in one last call, and end."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(_CLOSING_S)
        if self._thread.is_alive():
            self.error = self.error or TimeoutError(f'no answer of the disk in {_CLOSING_S:g} s')

    def _run(self) -> None:
        closing = False
        while not closing:
            closing = self._wait()
            if self._pending:
                self._call()

    def _wait(self) -> bool:
        """Wait for a request, or after a failure for the next attempt; return whether to end."""
        with self._changed:
            if self.error is None:
                self._changed.wait_for(lambda: self._pending or self._closing)
            else:
                self._changed.wait_for(lambda: self._closing, self._retry_s)
            return self._closing

    def _call(self) -> None:
        self._pending = False  # before the call: what is requested meanwhile needs another one
        try:
            self._save()
        except Exception as error:  # kept for the thread that reports it
            self._pending, self.error = True, error
        else:
            self.error = None
