"""`./ja doctor`: what it prints, its JSON for scripts, and its exit code."""

import json

import pytest
from typer.testing import CliRunner

from ja_bringup.cli import app
from ja_diagnostics import doctor
from ja_diagnostics.doctor import Finding

GOOD = Finding('Python', True, '3.12')
OPTIONAL = Finding('camera', False, 'none', 'plug one in', needed=False)
BAD = Finding('graphics', False, 'no libEGL', 'install libegl1')


@pytest.fixture
def findings(monkeypatch: pytest.MonkeyPatch):
    """Return a function that replaces the checks by ones with these findings."""

    def replace_checks(*found: Finding) -> None:
        monkeypatch.setattr(
            doctor, 'checks', lambda: {each.name: lambda each=each: each for each in found}
        )

    return replace_checks


@pytest.mark.parametrize(('found', 'code'), [((GOOD, OPTIONAL), 0), ((GOOD, BAD), 1)])
def test_the_exit_code_is_1_if_something_needed_is_wrong(found, code, findings):
    findings(*found)
    assert CliRunner().invoke(app, ['doctor']).exit_code == code


def test_each_finding_is_a_line_with_its_fix_below(findings):
    findings(GOOD, OPTIONAL, BAD)
    lines = CliRunner().invoke(app, ['doctor']).output.splitlines()
    assert lines == [
        'ok    Python: 3.12',
        '-     camera: none',
        '      plug one in',
        'WRONG graphics: no libEGL',
        '      install libegl1',
    ]


def test_the_json_has_one_object_for_each_finding(findings):
    findings(GOOD, BAD)
    good, bad = json.loads(CliRunner().invoke(app, ['doctor', '--json']).stdout)
    assert good == {'name': 'Python', 'ok': True, 'text': '3.12', 'fix': '', 'needed': True}
    assert (bad['ok'], bad['fix']) == (False, 'install libegl1')
