"""Where the head turns: visual feedback (Eq. 2), the gate, the attention cycle, the limits."""
