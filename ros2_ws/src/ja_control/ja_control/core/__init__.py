"""Control algorithms without ROS."""
