"""Salient features, faces and cameras: from image_raw to detections."""
