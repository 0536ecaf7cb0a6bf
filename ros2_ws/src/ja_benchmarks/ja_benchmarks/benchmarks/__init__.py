"""Benchmarks of the whole graph; what a benchmark is: `ja_benchmarks.run_benchmarks`."""
