"""The floor of joint space, as ROS packages see it."""
