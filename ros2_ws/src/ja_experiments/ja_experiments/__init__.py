"""The paper's figures, ablations and sweeps, over the cores of the other packages."""
