"""Configuration as frozen dataclasses whose fields carry description, range and choices.

The same dataclass configures a core object in an experiment and becomes a node's ROS parameters
(`ja_common.parameters`). Units stand in the field's name (`stale_after_s`).
"""

import math
from dataclasses import MISSING, Field, field, fields
from typing import Any


class ConfigError(ValueError):
    """A configuration value that cannot be used; the message says which, why and what fits."""


def parameter(
    default: Any,
    description: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] | None = None,
) -> Any:
    """A dataclass field that documents itself; `low` and `high` are inclusive."""
    metadata = {'description': description, 'low': low, 'high': high, 'choices': choices}
    return field(default=default, metadata=metadata)


def checked(config_field: Field, value: Any) -> Any:
    """The value as the field's type. Raises ConfigError when type, range or choice do not fit."""
    name, default = config_field.name, config_field.default
    if default is MISSING:
        raise TypeError(f'{name} needs a default value to become a parameter')
    value = _converted(name, type(default), value)
    low, high = config_field.metadata.get('low'), config_field.metadata.get('high')
    if (low is not None and value < low) or (high is not None and value > high):
        raise ConfigError(f'{name} = {value!r} is outside {_range_text(low, high)}')
    choices = config_field.metadata.get('choices')
    if choices and value not in choices:
        raise ConfigError(f'{name} = {value!r} is not one of {", ".join(choices)}')
    return value


def check(config: Any) -> None:
    """Check every field of a configuration dataclass. Raises ConfigError for the first bad one."""
    for config_field in fields(config):
        if 'description' in config_field.metadata:
            checked(config_field, getattr(config, config_field.name))


def _converted(name: str, wanted: type, value: Any) -> Any:
    if wanted is float and type(value) is int:
        value = float(value)
    if type(value) is not wanted:
        raise ConfigError(
            f'{name} = {value!r} is {_named(type(value))}; {_named(wanted)} is needed'
        )
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f'{name} = {value!r} is not a finite number')
    return value


def _named(kind: type) -> str:
    return f'{"an" if kind is int else "a"} {kind.__name__}'


def _range_text(low: float | None, high: float | None) -> str:
    if low is None:
        return f'the range up to {high}'
    return f'the range from {low}' if high is None else f'the range {low} to {high}'
