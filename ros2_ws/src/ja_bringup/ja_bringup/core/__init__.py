"""What bringup computes without ROS."""
