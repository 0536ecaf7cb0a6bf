"""A node introduces itself again when it, or another, may have been forgotten."""

import pytest

from ja_common.discovery_refresher import DiscoveryRefresher
from ja_common.ros_defaults import LEASE_S


class FakeNode:
    """The names that it sees, and how often it has made an entity: that is what tells its own."""

    def __init__(self, *names):
        self.see(*names)
        self.introduced = 0

    def see(self, *names):
        self.names = [(name, '/') for name in names]

    def get_node_names_and_namespaces(self):
        return self.names

    def create_publisher(self, *_):
        self.introduced += 1

    def destroy_publisher(self, _):
        pass


def test_it_introduces_itself_only_after_a_halt_that_others_take_for_its_end():
    node = FakeNode('me', 'you')
    presence = DiscoveryRefresher(node)
    assert presence.refresh(11.0) == 0.0, 'how long it took to begin is no halt'
    assert presence.refresh(11.0 + 0.9 * LEASE_S) == 0.0
    assert node.introduced == 0
    assert presence.refresh(20.0) == pytest.approx(9.0 - 0.9 * LEASE_S)
    assert node.introduced == 1
    assert presence.refresh(21.0) == 0.0
    assert node.introduced == 1


def test_it_introduces_itself_to_one_that_returns():
    node = FakeNode('me')
    presence = DiscoveryRefresher(node)
    for second, names, introduced in (
        (1, ['me', 'you'], 0),  # new here: DDS tells it by itself
        (2, ['me'], 0),
        (3, ['me', 'you'], 1),
        (4, ['me', 'you'], 1),
    ):
        node.see(*names)
        presence.refresh(float(second))
        assert node.introduced == introduced
