"""The controller layer for ROS packages."""
