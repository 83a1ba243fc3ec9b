"""ros-coms: carries the steps of remote processes from supervisors to the robot, and the results back.

It is a separate process. It reaches the robot only by rosbridge, and supervisors by one of several transports. It
stores nothing: the robot's journal contains every step, and the supervisors' server stores a command until its result
has arrived.
"""
