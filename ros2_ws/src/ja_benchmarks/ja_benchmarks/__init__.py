"""Every benchmark: speed, memory, learning."""
