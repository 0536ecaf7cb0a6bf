"""The command `./ja bench`; the benchmarks themselves are not run here."""

import importlib
import json
import sys
import types

import pytest

from ja_benchmarks import run_benchmarks as bench
from ja_benchmarks.rows import Row, row
from ja_benchmarks.run_benchmarks import benchmarks, run_benchmarks
from ja_common.core.config import ConfigError


@pytest.fixture
def two_benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    """`slow` and `fast`, in place of those that are installed; `slow` has a quick form."""

    def rows(value: float) -> dict[str, Row]:
        return {'speed': {'value': value, 'unit': 'm/s', 'n': 3, 'interval': [0.5, 9.5]}}

    slow, fast = types.ModuleType('slow'), types.ModuleType('fast')
    slow.run = lambda quick=False: rows(2.0 if quick else 1.0)  # type: ignore[attr-defined]
    fast.run = lambda: rows(9.0)  # type: ignore[attr-defined]
    for module in (slow, fast):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(bench, 'benchmarks', lambda: {'fast': 'fast', 'slow': 'slow'})


def test_every_installed_benchmark_can_be_run():
    found = benchmarks()
    assert {'graph', 'middleware'} <= set(found)
    for module in found.values():
        assert callable(importlib.import_module(module).run), module


@pytest.mark.usefixtures('two_benchmarks')
def test_one_or_all_are_printed_and_written(tmp_path, capsys):
    path = tmp_path / 'figures.json'
    assert run_benchmarks('slow', path) == 0
    assert json.loads(path.read_text()) == {
        'slow/speed': {'value': 1.0, 'unit': 'm/s', 'n': 3, 'interval': [0.5, 9.5]}
    }
    assert run_benchmarks(None, path) == 0
    assert set(json.loads(path.read_text())) == {'slow/speed', 'fast/speed'}
    assert 'm/s' in capsys.readouterr().out


@pytest.mark.usefixtures('two_benchmarks')
@pytest.mark.parametrize('name', ['slow', None])
def test_quick_runs_the_quick_forms_under_names_of_their_own(name, tmp_path):
    path = tmp_path / 'figures.json'
    assert run_benchmarks(name, path, quick=True) == 0
    figures = json.loads(path.read_text())
    assert {key: figure['value'] for key, figure in figures.items()} == {'slow --quick/speed': 2.0}


@pytest.mark.usefixtures('two_benchmarks')
def test_a_benchmark_without_a_quick_form_is_named():
    with pytest.raises(ConfigError, match='fast has no quick form; these have one: slow'):
        run_benchmarks('fast', None, quick=True)


@pytest.mark.usefixtures('two_benchmarks')
def test_wrong_names_and_places_are_refused_before_anything_runs(tmp_path):
    with pytest.raises(ConfigError, match="no benchmark 'other'; there are: fast, slow"):
        run_benchmarks('other', None)
    with pytest.raises(ConfigError, match='there is no folder'):
        run_benchmarks('fast', tmp_path / 'nowhere' / 'figures.json')


def test_the_interval_of_a_row_holds_its_value():
    figure = row([1.0, 2.0, 3.0, 4.0], 'ms')
    low, high = figure['interval']
    assert figure['value'] == 2.5
    assert figure['n'] == 4
    assert 1.0 <= low < 2.5 < high <= 4.0
