"""`stubborn`: ignores SIGINT and SIGTERM, as a node that hangs in a library does."""

import signal
import time


def main() -> None:
    """Log one error, and ignore signals."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    print('[ERROR] [stubborn]: here I stand', flush=True)
    while True:
        time.sleep(1.0)
