"""Configuration dataclasses: which values are refused, and with which message."""

import re
from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from ja_common.core.config import (
    ConfigError,
    Configuration,
    checked,
    interval_parameter,
    parameter,
)


@dataclass(frozen=True)
class Config(Configuration):
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
    made = getattr(replace(Config(), **{name: value}), name)
    assert (made, type(made)) == (result, type(result))


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
        Config(**{name: value})


def test_parameter_without_a_default_is_a_type_error():
    @dataclass
    class Bare:
        value: float

    with pytest.raises(TypeError, match='default'):
        checked(fields(Bare)[0], 1.0)


def test_number_of_numpy_becomes_a_float():
    gain = Config(gain=np.float64(2.0)).gain
    assert type(gain) is float
    assert gain == 2.0


@dataclass(frozen=True)
class Span(Configuration):
    low: float = parameter(0.0, 'lower end', low=-1.0, high=1.0)
    high: float = parameter(0.5, 'upper end', low=-1.0, high=1.0)
    share: tuple[float, float] = interval_parameter((0.2, 0.4), 'drawn from', 0.0, 1.0)
    note: str = 'no parameter, and not checked'

    def check_together(self):
        if self.low >= self.high:
            raise ConfigError('low must stay below high')


def test_fields_are_checked_one_by_one_and_then_together():
    assert Span(low=-1).low == -1.0
    assert Span(note=None).note is None
    with pytest.raises(ConfigError, match=r'^low = -2\.0 is outside the range -1\.0 to 1\.0$'):
        Span(low=-2, high=-3)
    with pytest.raises(ConfigError, match=r'^low must stay below high$'):
        replace(Span(), low=0.5)


@pytest.mark.parametrize(
    ('share', 'message'),
    [
        ([0.2, 0.4], r'share = [0.2, 0.4] is not a pair [low, high] of numbers'),
        ((0.2,), r'share = (0.2,) is not a pair [low, high] of numbers'),
        ((0.2, True), r'share = (0.2, True) is not a pair [low, high] of numbers'),
        ((0.4, 0.2), r'share = [0.4, 0.2] is not a rising pair in [0.0, 1.0]'),
        ((0.2, 1.2), r'share = [0.2, 1.2] is not a rising pair in [0.0, 1.0]'),
    ],
)
def test_interval_that_does_not_fit_is_refused(share, message):
    assert Span(share=(0, 1)).share == (0, 1)
    with pytest.raises(ConfigError, match=f'^{re.escape(message)}$'):
        Span(share=share)
