"""The robot layer for ROS packages."""
