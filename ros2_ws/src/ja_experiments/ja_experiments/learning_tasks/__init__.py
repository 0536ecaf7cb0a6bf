"""The learning problem itself as tasks that any learner can enter, with a score and baselines."""
