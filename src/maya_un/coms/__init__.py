"""ros-coms: carries the steps of remote processes from supervisors to the robot, and the results back.

A process of its own. It reaches the robot by rosbridge alone, and supervisors by one of several transports. It stores
nothing: the robot's journal knows every step, and the other side keeps a command until its result has arrived.
"""
