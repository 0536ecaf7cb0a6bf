"""`python -m ja_bringup COMMAND`, as `./ja COMMAND` starts it."""

import signal

from ja_common.stop_signals import end_quietly_at_sigint


def main() -> None:
    """Import the commands and run one; Ctrl-C meanwhile ends the process without a word."""
    end_quietly_at_sigint()  # `./ja` has blocked it
    from ja_bringup.cli import main as run

    signal.signal(signal.SIGINT, signal.default_int_handler)
    run()


if __name__ == '__main__':
    main()
