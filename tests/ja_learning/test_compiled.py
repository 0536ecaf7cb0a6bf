"""Compiled code works where it cannot be cached: on a full disk, and without any folder for it."""

import numba.core.caching

from files_testing import disk_with_room_for
from ja_learning.core.compiled import compiled


def double(number):
    return 2 * number


def test_a_full_disk_costs_the_cache_and_not_the_call(tmp_path, monkeypatch):
    monkeypatch.setattr('numba.core.config.CACHE_DIR', str(tmp_path))
    function = compiled(double)
    with disk_with_room_for(0):
        assert function(4) == 8
    assert not [path for path in tmp_path.rglob('*') if path.is_file() and path.stat().st_size]


def test_code_is_cached_where_it_can(tmp_path, monkeypatch):
    monkeypatch.setattr('numba.core.config.CACHE_DIR', str(tmp_path))
    assert compiled(double)(4) == 8
    assert list(tmp_path.rglob('*.nbi'))


def test_without_a_folder_for_the_cache_it_compiles(monkeypatch):
    monkeypatch.setattr(numba.core.caching.CompileResultCacheImpl, '_locator_classes', [])
    assert compiled(double)(4) == 8
