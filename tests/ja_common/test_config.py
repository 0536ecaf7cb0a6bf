"""Configuration as dataclasses: what is refused, and in which words."""

import re
from dataclasses import dataclass, fields, replace

import pytest

from ja_common.core.config import ConfigError, check, checked, parameter


@dataclass(frozen=True)
class Config:
    rate_hz: float = parameter(10.0, 'images a second', low=0.5, high=30.0)
    gain: float = parameter(1.0, 'no upper bound', low=0.0)
    offset: float = parameter(0.0, 'no lower bound', high=1.0)
    count: int = parameter(5, 'whole', low=1)
    loud: bool = parameter(False, 'yes or no')
    colour: str = parameter('red', 'one of some', choices=('red', 'green'))
    file: str = parameter('', 'any text')


FIELD = {field.name: field for field in fields(Config)}


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('rate_hz', 0.5),
        ('rate_hz', 30.0),
        ('rate_hz', 12),
        ('gain', 1e300),
        ('offset', -1e300),
        ('count', 10**12),
        ('loud', True),
        ('colour', 'green'),
        ('file', '~/a b.npz'),
    ],
)
def test_good_value_is_accepted_as_the_type_of_the_field(name, value):
    result = checked(FIELD[name], value)
    assert result == value
    assert type(result) is type(FIELD[name].default)
    check(replace(Config(), **{name: result}))


@pytest.mark.parametrize(
    ('name', 'value', 'message'),
    [
        ('rate_hz', 0.4, 'rate_hz = 0.4 is outside the range 0.5 to 30.0'),
        ('rate_hz', 31, 'rate_hz = 31.0 is outside the range 0.5 to 30.0'),
        ('gain', -1.0, 'gain = -1.0 is outside the range from 0.0'),
        ('offset', 1.5, 'offset = 1.5 is outside the range up to 1.0'),
        ('rate_hz', float('nan'), 'rate_hz = nan is not a finite number'),
        ('gain', float('inf'), 'gain = inf is not a finite number'),
        ('rate_hz', True, 'rate_hz = True is a bool; a float is needed'),
        ('rate_hz', '12', "rate_hz = '12' is a str; a float is needed"),
        ('count', 5.0, 'count = 5.0 is a float; an int is needed'),
        ('count', True, 'count = True is a bool; an int is needed'),
        ('count', 0, 'count = 0 is outside the range from 1'),
        ('loud', 1, 'loud = 1 is an int; a bool is needed'),
        ('colour', 'blue', "colour = 'blue' is not one of red, green"),
        ('file', None, 'file = None is a NoneType; a str is needed'),
    ],
)
def test_bad_value_is_refused_in_one_sentence(name, value, message):
    with pytest.raises(ConfigError, match=f'^{re.escape(message)}$'):
        checked(FIELD[name], value)
    with pytest.raises(ConfigError, match=f'^{re.escape(message)}$'):
        check(replace(Config(), **{name: value}))


def test_parameter_without_a_default_is_a_fault_of_the_programmer():
    @dataclass
    class Bare:
        value: float

    with pytest.raises(TypeError, match='default'):
        checked(fields(Bare)[0], 1.0)
