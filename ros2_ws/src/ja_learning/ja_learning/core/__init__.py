"""Learning algorithms without ROS."""
