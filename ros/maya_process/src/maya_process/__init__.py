"""The process layer for ROS packages."""
