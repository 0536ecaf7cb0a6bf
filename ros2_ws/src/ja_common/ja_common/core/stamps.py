"""Stamps are integers in nanoseconds inside core code."""

NS_PER_S = 1_000_000_000
