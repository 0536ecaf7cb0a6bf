"""Recordings of the graph: record, play back, cut into trials, data sets."""
