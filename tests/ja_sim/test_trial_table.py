"""The table of trials: no row is lost, doubled or cut, however writing fails."""

import csv

import pytest

from files_testing import disk_with_room_for
from ja_common.core.files import SaveError
from ja_sim.core.score import TrialOutcome
from ja_sim.core.trial_table import TrialTable


def outcome(trial: int) -> TrialOutcome:
    return TrialOutcome(trial, 10**9 * trial, 3, True, (0.1, 0.2), None, False)


def trials_in(path) -> list[int]:
    with path.open() as file:
        return [int(row['trial']) for row in csv.DictReader(file)]


def test_rows_wait_for_room(tmp_path):
    path = tmp_path / 'trials.csv'
    table = TrialTable(path)
    table.append_trial(outcome(1))
    table.save()
    size = path.stat().st_size
    for trial in (2, 3):
        table.append_trial(outcome(trial))
    with disk_with_room_for(size + 10), pytest.raises(SaveError, match='make room on its disk'):
        table.save()
    assert path.stat().st_size == size, 'half a row stayed'
    table.append_trial(outcome(4))
    table.save()
    table.save()
    assert trials_in(path) == [1, 2, 3, 4]


def test_a_table_that_was_removed_begins_again(tmp_path):
    path = tmp_path / 'folder' / 'trials.csv'
    table = TrialTable(path)
    path.unlink()
    path.parent.rmdir()
    table.append_trial(outcome(1))
    table.save()
    assert trials_in(path) == [1]


def test_a_table_that_cannot_be_begun_is_refused(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(SaveError, match='cannot be written'):
        TrialTable(tmp_path / 'file' / 'trials.csv')
