"""`python -m ja_bringup COMMAND`, as `./ja COMMAND` starts it."""

import signal


def main() -> None:
    """Import the commands and run one; Ctrl-C meanwhile ends the process without a word."""
    # Python's handler would end an import with a traceback. `./ja` has blocked SIGINT until here,
    # because Python sets its handler before any line of ours.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    from ja_bringup.cli import main as run

    signal.signal(signal.SIGINT, signal.default_int_handler)
    run()


if __name__ == '__main__':
    main()
