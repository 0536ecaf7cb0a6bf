"""A real person as the caregiver: what she is asked to look at, and how often the head follows."""
