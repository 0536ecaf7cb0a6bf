"""Benchmarks of single parts, without the graph; `ja_bringup.bench` runs them."""
