"""Write a recording in a separate thread, so that a slow disk never delays a subscriber."""

import queue
import threading
import time
from dataclasses import dataclass

from ja_recording.recording_folder import Channel, RecordingFolder

FLUSH_PERIOD_S = 0.5


@dataclass(frozen=True)
class QueuedMessage:
    """One message that waits for the disk."""

    channel: Channel
    data: bytes
    stamp_ns: int
    sent_ns: int
    sequence: int


class BackgroundWriter:
    """A bounded queue in front of a `RecordingFolder`; messages that do not fit are dropped.

    `written`, `dropped`: counts of messages. `failure`: why writing ended too early, in one
    sentence; None while there is no error.
    """

    def __init__(self, folder: RecordingFolder, queue_bytes: int) -> None:
        self._folder = folder
        self._limit = queue_bytes
        self._queue: queue.SimpleQueue[QueuedMessage | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._waiting_bytes = 0
        self.written = 0
        self.dropped = 0
        self.failure: str | None = None
        self._thread = threading.Thread(target=self._run, name='recorder', daemon=True)
        self._thread.start()

    def queue_message(self, message: QueuedMessage) -> None:
        """Queue a message for writing, or count it as dropped; return at once."""
        size = len(message.data)
        with self._lock:
            if self.failure or self._waiting_bytes + size > self._limit:
                self.dropped += 1
                return
            self._waiting_bytes += size
        self._queue.put(message)

    def close(self) -> None:
        """Write the queued messages, and close the recording."""
        self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        try:
            self._write_all()
        except Exception as error:
            self.failure = f'the recording has ended: {error}'
        finally:
            try:
                self._folder.close()
            except OSError as error:
                self.failure = self.failure or f'the recording was not closed correctly: {error}'

    def _write_all(self) -> None:
        due_s = time.monotonic() + FLUSH_PERIOD_S
        while True:
            try:
                message = self._queue.get(timeout=max(0.0, due_s - time.monotonic()))
            except queue.Empty:
                pass
            else:
                if message is None:
                    return
                self._write(message)
            if time.monotonic() >= due_s:
                self._folder.flush()
                due_s = time.monotonic() + FLUSH_PERIOD_S

    def _write(self, message: QueuedMessage) -> None:
        self._folder.write_message(
            message.channel, message.data, message.stamp_ns, message.sent_ns, message.sequence
        )
        with self._lock:
            self._waiting_bytes -= len(message.data)
        self.written += 1
