"""The flight recorder: what the robot was, and what was said to its controller, in the last minutes."""
