"""Learning with self-evaluation: the internal evaluator (Eq. 3) and the learning module."""
