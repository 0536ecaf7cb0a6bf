"""The count of trials in a file: written atomically, and refused when it is no count."""

import pytest

from ja_control.core.trial_count import load_trials, save_trials


def test_saved_count_is_loaded(tmp_path):
    path = tmp_path / 'not' / 'there' / 'yet' / 'trials'
    assert load_trials(path) == 0
    save_trials(path, 120_000)
    assert load_trials(path) == 120_000
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize('content', [b'', b'many', b'-3', b'\xff\x00'])
def test_other_contents_are_refused(tmp_path, content):
    path = tmp_path / 'trials'
    path.write_bytes(content)
    with pytest.raises(ValueError, match='holds no count of trials'):
        load_trials(path)
