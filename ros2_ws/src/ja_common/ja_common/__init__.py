"""What several packages of Joint Attention on ROS 2 need: the wire, and the geometry behind it."""
