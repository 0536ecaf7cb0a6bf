"""The topics that a recording leaves out unless it is asked for them."""

DEFAULT_EXCLUDE = 'image_annotated|face_landmarks|(depth|right)/image_raw'
"""Regular expression.

A subscriber to the first two makes the detector compute them. The others are at
least as large as the picture itself, and what is learned from them is in the ranges of detections.
"""
