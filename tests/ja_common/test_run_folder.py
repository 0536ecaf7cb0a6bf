"""Every run has a folder of its own, however many begin in the same second."""

import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from ja_common.core.config import ConfigError
from ja_common.core.run_folder import new_run_folder


@pytest.fixture
def _noon(monkeypatch):
    """Let every run begin in the same second."""
    monkeypatch.setattr(time, 'strftime', lambda _: '20260101-120000')


@pytest.mark.usefixtures('_noon')
def test_runs_of_the_same_second_have_folders_of_their_own(tmp_path):
    parent = tmp_path / 'deep' / 'runs'
    with ThreadPoolExecutor(8) as pool:
        folders = list(pool.map(lambda _: new_run_folder('demo', parent), range(40)))
    assert len(set(folders)) == 40
    assert all(folder.is_dir() for folder in folders)
    assert set(parent.glob('20260101-120000*-demo')) == set(folders)
    assert parent / '20260101-120000-demo' in folders


@pytest.mark.usefixtures('_noon')
def test_other_runs_of_the_same_second_do_not_number_it(tmp_path):
    names = [new_run_folder(name, tmp_path).name for name in ('demo', 'record', 'demo')]
    assert names == ['20260101-120000-demo', '20260101-120000-record', '20260101-120000-2-demo']


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    (tmp_path / 'runs').write_text('a file')
    with pytest.raises(ConfigError, match=r'runs.* cannot be written'):
        new_run_folder('demo', tmp_path / 'runs')
    (tmp_path / 'link').symlink_to('nowhere')
    with pytest.raises(ConfigError, match='cannot be written'):
        new_run_folder('demo', tmp_path / 'link')
