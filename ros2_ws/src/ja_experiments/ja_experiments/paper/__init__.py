"""The paper's experiment: Figures 6 and 7, ablations, the compiled kernel."""
