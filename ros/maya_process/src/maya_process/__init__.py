"""The floor of processes, as ROS packages see it."""
