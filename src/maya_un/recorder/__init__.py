"""The flight recorder: the states of the robot, and the traffic with its controller, in the last minutes."""
