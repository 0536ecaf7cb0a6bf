"""What a head is like, found by moving it and watching the picture (`./ja calibrate`)."""
