"""The folder for files that can be made or fetched again."""

import os
import tempfile
from pathlib import Path


def cache_folder() -> Path:
    """Return $JA_CACHE, or joint-attention in the user's cache folder; it may not exist yet.

    A user without a home folder has it among the temporary files.
    """
    chosen = os.environ.get('JA_CACHE')
    return Path(chosen) if chosen else _users_cache() / 'joint-attention'


def _users_cache() -> Path:
    if folder := os.environ.get('XDG_CACHE_HOME'):
        return Path(folder)
    try:
        return Path.home() / '.cache'
    except RuntimeError:
        return Path(tempfile.gettempdir())
