"""Small real nodes, a good one and two bad ones, for the tests of the composition."""
