"""Configuration dataclasses as ROS parameters: documented, checked, all or nothing."""

from dataclasses import dataclass

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter

from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.parameters import choices_of, declare_config


@dataclass(frozen=True)
class Config(Configuration):
    low: float = parameter(0.0, 'lower end', low=-1.0, high=1.0)
    high: float = parameter(0.5, 'upper end', low=-1.0, high=1.0)
    count: int = parameter(5, 'how many', low=1)
    colour: str = parameter('red', 'which colour', choices=('red', 'green'))

    def check_together(self):
        if self.low >= self.high:
            raise ConfigError('low must stay below high')


@dataclass(frozen=True)
class OtherConfig(Configuration):
    loud: bool = parameter(False, 'yes or no')


@pytest.fixture
def make_node(ros_context):
    nodes = []

    def make(**overrides):
        overrides = [Parameter(name, value=value) for name, value in overrides.items()]
        nodes.append(Node('n', context=ros_context, parameter_overrides=overrides))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()


def set_all(node, **values):
    parameters = [Parameter(name, value=value) for name, value in values.items()]
    return node.set_parameters_atomically(parameters)


def test_defaults_and_overrides(make_node):
    assert declare_config(make_node(), Config) == Config()
    config = declare_config(make_node(low=-1, colour='green'), Config)
    assert config == Config(low=-1.0, colour='green')
    assert type(config.low) is float, 'a whole number stands for a float'


def test_a_float_stays_one_for_all_who_read_the_parameter(make_node):
    node = make_node(low=-1)
    declare_config(node, Config, lambda config: None)
    assert node.get_parameter('low').type_ is Parameter.Type.DOUBLE
    assert set_all(node, low=0, high=1, count=7).successful
    kinds = [node.get_parameter(name).type_ for name in ('low', 'high', 'count')]
    assert kinds == [Parameter.Type.DOUBLE, Parameter.Type.DOUBLE, Parameter.Type.INTEGER]


def test_parameters_describe_themselves(make_node):
    node = make_node()
    declare_config(node, Config)
    colour = node.describe_parameter('colour')
    assert colour.description == 'which colour (one of red, green) (read-only)'
    assert colour.additional_constraints == 'one of: red, green'
    assert choices_of(colour) == ('red', 'green')
    assert choices_of(node.describe_parameter('low')) == ()
    (bounds,) = node.describe_parameter('low').floating_point_range
    assert (bounds.from_value, bounds.to_value) == (-1.0, 1.0)
    assert node.describe_parameter('count').integer_range[0].from_value == 1
    assert node.describe_parameter('low').read_only
    assert node.describe_parameter('low').description == 'lower end (read-only)'


@pytest.mark.parametrize(
    ('override', 'text'),
    [
        ({'low': 'high'}, "low = 'high' is a str; a float is needed"),
        ({'low': -2.0}, 'low = -2.0 is outside the range'),
        ({'low': -2}, 'low = -2.0 is outside the range'),
        ({'count': 0}, 'count = 0 is outside the range'),
        ({'count': True}, 'count = True is a bool'),
        ({'colour': 'blue'}, "colour = 'blue' is not one of red, green"),
        ({'low': [0.1, 0.2]}, 'a float is needed'),
        ({'low': 0.7}, 'low must stay below high'),
    ],
)
def test_bad_override_is_one_error_that_names_node_and_parameter(make_node, override, text):
    with pytest.raises(ConfigError, match=f'^/n: .*{text}'):
        declare_config(make_node(**override), Config)


def test_set_while_running(make_node):
    changes = []
    node = make_node()
    declare_config(node, Config, changes.append)
    assert set_all(node, low=0, count=7).successful
    assert changes == [Config(low=0.0, count=7)]
    assert set_all(node, high=0.75).successful
    assert changes[-1] == Config(low=0.0, high=0.75, count=7), 'earlier changes are kept'


@pytest.mark.parametrize(
    ('values', 'reason'),
    [
        ({'high': 'x'}, 'high = '),
        ({'high': 1.5}, 'high out of range'),
        ({'high': float('nan')}, 'high'),
        ({'high': 2}, 'high out of range'),
        ({'high': -0.5}, 'low must stay below high'),
        ({'count': 9, 'colour': 'blue'}, 'colour'),
        ({'count': None}, 'count = None'),
    ],
)
def test_bad_value_is_refused_with_the_reason_and_nothing_changes(make_node, values, reason):
    changes = []
    node = make_node()
    declare_config(node, Config, changes.append)
    result = set_all(node, **values)
    assert not result.successful
    assert reason in result.reason
    assert changes == []
    for name in values:
        assert node.get_parameter(name).value == getattr(Config(), name)


def test_two_configurations_of_one_node_do_not_disturb_each_other(make_node):
    node, first, second = make_node(), [], []
    declare_config(node, Config, first.append)
    declare_config(node, OtherConfig, second.append)
    assert set_all(node, loud=True).successful
    assert (first, second) == ([], [OtherConfig(loud=True)])
    assert not set_all(node, loud=False, low=5.0).successful
    assert (first, second) == ([], [OtherConfig(loud=True)])


def test_read_only_parameter_cannot_be_set(make_node):
    node = make_node()
    declare_config(node, Config)
    result = set_all(node, low=0.1)
    assert not result.successful
    assert 'read-only' in result.reason


def test_a_parameter_that_may_be_set_is_not_called_read_only(make_node):
    node = make_node()
    declare_config(node, Config, lambda config: None)
    colour = node.describe_parameter('colour')
    assert colour.description == 'which colour (one of red, green)'
    assert choices_of(colour) == ('red', 'green')
