"""Configuration as frozen dataclasses whose fields carry description, range and choices.

The same dataclass configures a core object in an experiment and becomes a node's ROS parameters
(`ja_common.parameters`). Units stand in the field's name (`stale_after_s`).
"""

import math
from dataclasses import MISSING, Field, field, fields
from typing import Any

_SHOWN = 200


class ConfigError(ValueError):
    """A configuration value that cannot be used; the message names field, reason and range."""


class Configuration:
    """Base of every configuration dataclass: its fields are checked when an object is made.

    Made in Python, from YAML or from ROS parameters, a configuration never holds a value outside
    its range. A whole number given for a float becomes a float. Derive with
    `@dataclass(frozen=True)`, and overwrite `check_together` for rules about several fields.
    """

    def __post_init__(self) -> None:
        for config_field in fields(self):  # type: ignore[arg-type]
            if 'description' in config_field.metadata:
                value = checked(config_field, getattr(self, config_field.name))
                object.__setattr__(self, config_field.name, value)
        self.check_together()

    def check_together(self) -> None:
        """Raise ConfigError when values that fit one by one do not fit each other."""


def parameter(
    default: Any,
    description: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] | None = None,
) -> Any:
    """Make a dataclass field that documents itself; `low` and `high` are inclusive."""
    metadata = {'description': description, 'low': low, 'high': high, 'choices': choices}
    return field(default=default, metadata=metadata)


def interval_parameter(
    default: tuple[float, float], description: str, low: float, high: float
) -> Any:
    """Make a field for a rising pair (from, to) of numbers between `low` and `high`."""
    return field(default=default, metadata={'description': description, 'bounds': (low, high)})


def checked(config_field: Field, value: Any) -> Any:
    """Return the value as the field's type. Raise ConfigError when it does not fit the field."""
    name, default = config_field.name, config_field.default
    if default is MISSING:
        raise TypeError(f'{name} needs a default value to become a parameter')
    if 'bounds' in config_field.metadata:
        return _checked_interval(name, value, *config_field.metadata['bounds'])
    value = _converted(name, type(default), value)
    low, high = config_field.metadata.get('low'), config_field.metadata.get('high')
    if (low is not None and value < low) or (high is not None and value > high):
        raise ConfigError(f'{name} = {_shown(value)} is outside {_range_text(low, high)}')
    choices = config_field.metadata.get('choices')
    if choices and value not in choices:
        raise ConfigError(f'{name} = {_shown(value)} is not one of {", ".join(choices)}')
    return value


def _checked_interval(name: str, value: Any, low: float, high: float) -> tuple[float, float]:
    pair = isinstance(value, tuple) and len(value) == 2
    if not pair or any(type(bound) not in (int, float) for bound in value):
        raise ConfigError(f'{name} = {_shown(value)} is not a pair [low, high] of numbers')
    if not low <= value[0] <= value[1] <= high:
        shown = _shown(list(value))
        raise ConfigError(f'{name} = {shown} is not a rising pair in [{low}, {high}]')
    return value


def _converted(name: str, wanted: type, value: Any) -> Any:
    if wanted is float and (type(value) is int or isinstance(value, float)):
        try:
            value = float(value)  # a whole number, or a scalar of numpy
        except OverflowError:
            raise ConfigError(f'{name} = {_shown(value)} is too large for a float') from None
    if type(value) is not wanted:
        raise ConfigError(
            f'{name} = {_shown(value)} is {_named(type(value))}; {_named(wanted)} is needed'
        )
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f'{name} = {value!r} is not a finite number')
    return value


def _shown(value: Any) -> str:
    """Return the value as Python writes it; a long one is cut, since it may come from a file."""
    text = repr(value)
    return text if len(text) <= _SHOWN else f'{text[:_SHOWN]}...'


def _named(kind: type) -> str:
    return f'{"an" if kind is int else "a"} {kind.__name__}'


def _range_text(low: float | None, high: float | None) -> str:
    if low is None:
        return f'the range up to {high}'
    return f'the range from {low}' if high is None else f'the range {low} to {high}'
