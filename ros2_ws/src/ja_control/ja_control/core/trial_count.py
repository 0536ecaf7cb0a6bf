"""The count of finished trials, on which p(LM) depends, in a file."""

import os
from pathlib import Path


def load_trials(path: Path) -> int:
    """Return the count in a file; 0 without a file. Raises ValueError when it holds no count."""
    try:
        text = path.read_text(encoding='ascii')
        return int(text) if text.strip().isdecimal() else _refuse(path)
    except FileNotFoundError:
        return 0
    except UnicodeDecodeError:
        return _refuse(path)


def save_trials(path: Path, trials: int) -> None:
    """Write the count atomically: the file is always the old or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f'.{path.name}.{os.getpid()}')
    temporary.write_text(f'{trials}\n', encoding='ascii')
    os.replace(temporary, path)


def _refuse(path: Path) -> int:
    raise ValueError(f'{path} holds no count of trials: correct or remove it')
