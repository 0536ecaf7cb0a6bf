"""Writes a recording in a thread of its own, so that a slow disk never holds a subscriber up."""

import queue
import threading
import time
from dataclasses import dataclass

from ja_recording.recording_folder import Channel, RecordingFolder

FLUSH_EVERY_S = 0.5


@dataclass(frozen=True)
class Sample:
    """One message on its way to the disk."""

    channel: Channel
    data: bytes
    stamp_ns: int
    sent_ns: int
    sequence: int


class BackgroundWriter:
    """A bounded queue before a `RecordingFolder`; what does not fit is counted, not waited for.

    `failure`: why writing has ended before its time, in one sentence; None while all is well.
    """

    def __init__(self, folder: RecordingFolder, queue_bytes: int) -> None:
        self._folder = folder
        self._limit = queue_bytes
        self._queue: queue.SimpleQueue[Sample | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._waiting_bytes = 0
        self.written = 0
        self.dropped = 0
        self.failure: str | None = None
        self._thread = threading.Thread(target=self._run, name='recorder', daemon=True)
        self._thread.start()

    def put(self, sample: Sample) -> None:
        """Leave a message for writing; returns at once."""
        size = len(sample.data)
        with self._lock:
            if self.failure or self._waiting_bytes + size > self._limit:
                self.dropped += 1
                return
            self._waiting_bytes += size
        self._queue.put(sample)

    def close(self) -> None:
        """Write what waits, and end the recording."""
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
                self.failure = self.failure or f'the recording was not ended well: {error}'

    def _write_all(self) -> None:
        due_s = time.monotonic() + FLUSH_EVERY_S
        while True:
            try:
                sample = self._queue.get(timeout=max(0.0, due_s - time.monotonic()))
            except queue.Empty:
                pass
            else:
                if sample is None:
                    return
                self._write(sample)
            if time.monotonic() >= due_s:
                self._folder.flush()
                due_s = time.monotonic() + FLUSH_EVERY_S

    def _write(self, sample: Sample) -> None:
        self._folder.write(
            sample.channel, sample.data, sample.stamp_ns, sample.sent_ns, sample.sequence
        )
        with self._lock:
            self._waiting_bytes -= len(sample.data)
        self.written += 1
