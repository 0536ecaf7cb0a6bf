"""Configuration dataclasses (`ja_common.core.config`) as self-describing ROS parameters."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ja_common.core.config import ConfigError, Configuration, checked
from ja_common.rclpy_private import parameter_overrides

Config = TypeVar('Config', bound=Configuration)

UNBOUNDED = 1e9
"""Stands in a descriptor for an end that a range does not have."""


READ_ONLY = ' (read-only)'
"""Ends the description of a read-only parameter."""

# In `additional_constraints`: ROS's descriptors have no field for choices.
_ONE_OF = 'one of: '


def declare_config(
    node: Node, config_class: type[Config], changed: Callable[[Config], None] | None = None
) -> Config:
    """Declare every field of a configuration as a parameter; return the values as one object.

    With `changed` the parameters may be set while the node runs: a bad value is refused with the
    reason and changes nothing, a good one gives `changed` the new configuration. Without it they
    are read-only. A whole number is accepted for a float, at the start and later, and becomes a
    float for all who read the parameter. Raises ConfigError for a bad override.
    """
    config_fields = {f.name: f for f in fields(config_class)}  # type: ignore[arg-type]
    overrides = parameter_overrides(node)
    values = {}
    try:
        for name, config_field in config_fields.items():
            descriptor = _descriptor(config_field, read_only=changed is None)
            given = overrides.get(name)
            # Checked here, so that a whole number is declared as a float, and stays one.
            value = config_field.default if given is None else checked(config_field, given)
            node.declare_parameter(name, value, descriptor, ignore_override=True)
            values[name] = value
        config = config_class(**values)
    except (ConfigError, InvalidParameterValueException) as error:
        raise ConfigError(f'{node.get_fully_qualified_name()}: parameters: {error}') from None
    if changed is None:
        return config

    current = config

    def updated(parameters: list[Parameter]) -> Config:
        ours = [p for p in parameters if p.name in config_fields]
        return replace(current, **{p.name: p.value for p in ours})  # type: ignore[type-var]

    def as_floats(parameters: list[Parameter]) -> list[Parameter]:
        return [_as_float(p) if p.name in floats else p for p in parameters]

    def validate(parameters: list[Parameter]) -> SetParametersResult:
        try:
            updated(parameters)
        except (ConfigError, ValueError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def apply(parameters: list[Parameter]) -> None:
        nonlocal current
        if any(p.name in config_fields for p in parameters):
            current = updated(parameters)
            changed(current)

    floats = {name for name, each in config_fields.items() if isinstance(each.default, float)}
    node.add_pre_set_parameters_callback(as_floats)
    node.add_on_set_parameters_callback(validate)
    node.add_post_set_parameters_callback(apply)
    return config


def _as_float(parameter: Parameter) -> Parameter:
    if parameter.type_ is not Parameter.Type.INTEGER:
        return parameter
    return Parameter(parameter.name, value=float(parameter.value))


def choices_of(descriptor: ParameterDescriptor) -> tuple[str, ...]:
    """Return the choices of a parameter that `declare_config` declared; () when it has none."""
    before, found, choices = descriptor.additional_constraints.partition(_ONE_OF)
    return tuple(choices.split(', ')) if found and not before else ()


def _descriptor(config_field: Any, read_only: bool) -> ParameterDescriptor:
    meta = config_field.metadata
    low, high = meta.get('low'), meta.get('high')
    text, constraints = meta['description'], ''
    if meta.get('choices'):
        choices = ', '.join(meta['choices'])
        text += f' (one of {choices})'
        constraints = f'{_ONE_OF}{choices}'
    if read_only:
        text += READ_ONLY
    # dynamic_typing lets `1` stand for `1.0`; the configuration then checks type and range.
    descriptor = ParameterDescriptor(
        name=config_field.name,
        description=text,
        additional_constraints=constraints,
        dynamic_typing=True,
        read_only=read_only,
    )
    if low is not None or high is not None:
        bounds = (-UNBOUNDED if low is None else low, UNBOUNDED if high is None else high)
        if isinstance(config_field.default, float):
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(bounds[0]), to_value=float(bounds[1]))
            ]
        elif isinstance(config_field.default, int):
            descriptor.integer_range = [
                IntegerRange(from_value=int(bounds[0]), to_value=int(bounds[1]))
            ]
    return descriptor
