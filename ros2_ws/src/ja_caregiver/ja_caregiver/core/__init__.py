"""Requests, schedules, scores and photographs of a real caregiver, without ROS."""
