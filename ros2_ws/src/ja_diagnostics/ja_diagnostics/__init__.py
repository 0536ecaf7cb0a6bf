"""Is this machine and this graph in order? Doctor, topic table, faults, soak."""
