"""The floor of primitives, as ROS packages see it."""
