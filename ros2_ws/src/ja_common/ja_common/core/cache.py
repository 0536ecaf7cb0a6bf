"""The folder for files that can be made or fetched again."""

import os
from pathlib import Path


def cache_folder() -> Path:
    """Return $JA_CACHE, or joint-attention in the user's cache folder; it may not exist yet."""
    home = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    return Path(os.environ.get('JA_CACHE') or Path(home) / 'joint-attention')
