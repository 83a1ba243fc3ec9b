"""Maya in ROS: the graph by the manual's names, nodes of ROS 1, ROS 2, rosbridge, and the check of old scripts.

Built on `maya_un`.
"""
