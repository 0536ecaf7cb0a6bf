"""Robots without ROS: the cores of the nodes in the simulated task and in Gymnasium."""
