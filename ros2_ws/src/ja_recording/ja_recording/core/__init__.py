"""Algorithms and records without ROS."""
