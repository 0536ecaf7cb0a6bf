"""Calibration of a pan-tilt rig: optics, signs, backlash, delay."""
