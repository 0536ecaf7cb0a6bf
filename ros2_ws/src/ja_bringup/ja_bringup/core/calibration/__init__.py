"""The course, the fits and who leads through them: pure, the same on a rig and in a test."""
