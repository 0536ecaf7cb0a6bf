"""Starts the graph: composition, configuration, supervision, progress, benchmarks."""
