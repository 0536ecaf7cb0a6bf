"""The count of finished trials, on which p(LM) depends, in a file."""

from pathlib import Path

from ja_common.core.files import write_file


def load_trials(path: Path) -> int:
    """Return the count in a file; 0 without a file. Raises ValueError when it has none to read."""
    try:
        text = path.read_text(encoding='ascii')
        return int(text) if text.strip().isdecimal() else _refuse(path)
    except FileNotFoundError:
        return 0
    except UnicodeDecodeError:
        return _refuse(path)
    except OSError as error:
        raise ValueError(f'{path} cannot be read ({error.strerror}): name another file') from None


def save_trials(path: Path, trials: int) -> None:
    """Write the count: the file is always the old or the new one. Raises SaveError."""
    write_file(path, f'{trials}\n')


def _refuse(path: Path) -> int:
    raise ValueError(f'{path} holds no count of trials: correct or remove it')
