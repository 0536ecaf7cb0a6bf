"""Recordings of the graph: MCAP files with ROS 2 schemas, in folders as rosbag2 writes them."""
