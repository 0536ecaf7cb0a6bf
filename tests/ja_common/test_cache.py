"""Where the cache folder is."""

from pathlib import Path

import pytest

from ja_common.core.cache import cache_folder


@pytest.mark.parametrize(
    ('variables', 'folder'),
    [
        ({'JA_CACHE': '/a', 'XDG_CACHE_HOME': '/b'}, Path('/a')),
        ({'XDG_CACHE_HOME': '/b'}, Path('/b/joint-attention')),
        ({}, Path.home() / '.cache' / 'joint-attention'),
    ],
)
def test_the_variables_of_the_environment_come_first(monkeypatch, variables, folder):
    for name in ('JA_CACHE', 'XDG_CACHE_HOME'):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert cache_folder() == folder
