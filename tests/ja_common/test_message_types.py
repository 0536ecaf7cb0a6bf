"""Names of message types come from anybody: nothing but an installed one is imported or read."""

import subprocess
import sys

import pytest

from hostile_folder import imported_from, make_hostile
from ja_common.core.config import ConfigError
from ja_common.message_types import message_class, schema_of

NAMES = [
    'evil/msg/X',
    'evil.sub/msg/X',
    'os/msg/path',
    'rclpy/msg/Node',
    'std_msgs/msg/../String',
    'std_msgs/msg/String.msg',
    '../../std_msgs/msg/String',
    '/std_msgs/msg/String',
    'std_msgs/msg/__builtins__',
    'std_msgs/msg/_string',
    'std_msgs/msg/String\n',
    'std_msgs/msg/String\0',
    'std_msgs/srv/String',
    'std_msgs',
    '',
    'x' * 10**6,
]


@pytest.mark.parametrize('name', NAMES, ids=lambda name: repr(name[:30]))
@pytest.mark.parametrize('look_up', [message_class, schema_of])
def test_a_name_that_is_no_installed_type_is_refused_in_a_sentence(name, look_up):
    with pytest.raises(ConfigError) as refused:
        look_up(name)
    assert len(str(refused.value)) < 1000


LOOKS_UP = """
import sys
sys.path.insert(0, '')  # as a start of `python -m` would leave it
from ja_common.core.config import ConfigError
from ja_common.message_types import message_class
for name in ('evil/msg/X', 'std_msgs/msg/String', 'json/msg/X'):
    try:
        message_class(name)
    except ConfigError:
        print('refused', name)
"""


def test_a_package_of_the_current_folder_is_never_imported(tmp_path):
    """Not even one that has the name of an installed package, and comes first on the path."""
    hostile = make_hostile(tmp_path / 'hostile')
    for name in ('ja_common', 'typing', 'pathlib'):  # what the test itself needs
        (hostile / f'{name}.py').unlink()
        (hostile / name / '__init__.py').unlink()
        (hostile / name).rmdir()
    for package in ('evil', 'std_msgs'):
        (hostile / 'share' / package / 'msg').mkdir(parents=True)
        (hostile / 'share' / package / 'msg' / 'X.msg').write_text('bool data')
    done = subprocess.run(
        [sys.executable, '-c', LOOKS_UP], cwd=hostile, capture_output=True, text=True, check=True
    )
    refused = [line.split()[1] for line in done.stdout.splitlines()]
    assert refused == ['evil/msg/X', 'std_msgs/msg/String', 'json/msg/X']
    assert imported_from(hostile) == []


def test_an_installed_type_is_found():
    assert message_class('std_msgs/msg/String')(data='x').data == 'x'
    assert 'MSG: std_msgs/Header' in schema_of('sensor_msgs/msg/Image')
