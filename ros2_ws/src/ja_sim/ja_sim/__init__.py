"""The simulated world seen through a camera, its scorer, and the digital pan-tilt head."""
