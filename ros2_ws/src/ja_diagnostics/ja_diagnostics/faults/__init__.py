"""Faults in the running graph: what the head does, and what is forgotten (`./ja faults`)."""
