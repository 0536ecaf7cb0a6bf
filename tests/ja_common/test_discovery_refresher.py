"""A node announces itself again after a halt of its own or of another node."""

import pytest

from ja_common.discovery_refresher import DiscoveryRefresher
from ja_common.ros_defaults import LEASE_S


class FakeNode:
    """Visible node names, and how often an entity was made: that announces the node's name."""

    def __init__(self, *names):
        self.set_visible(*names)
        self.announced = 0

    def set_visible(self, *names):
        self.names = [(name, '/') for name in names]

    def get_node_names_and_namespaces(self):
        return self.names

    def create_publisher(self, *_):
        self.announced += 1

    def destroy_publisher(self, _):
        pass


def test_node_announces_itself_only_after_a_halt_longer_than_the_lease():
    node = FakeNode('me', 'you')
    refresher = DiscoveryRefresher(node)
    assert refresher.refresh(11.0) == 0.0, 'the time before the first call is no halt'
    assert refresher.refresh(11.0 + 0.9 * LEASE_S) == 0.0
    assert node.announced == 0
    assert refresher.refresh(20.0) == pytest.approx(9.0 - 0.9 * LEASE_S)
    assert node.announced == 1
    assert refresher.refresh(21.0) == 0.0
    assert node.announced == 1


def test_node_announces_itself_to_a_node_that_returns():
    node = FakeNode('me')
    refresher = DiscoveryRefresher(node)
    for second, names, announced in (
        (1, ['me', 'you'], 0),  # new: DDS sends the name by itself
        (2, ['me'], 0),
        (3, ['me', 'you'], 1),
        (4, ['me', 'you'], 1),
    ):
        node.set_visible(*names)
        refresher.refresh(float(second))
        assert node.announced == announced
