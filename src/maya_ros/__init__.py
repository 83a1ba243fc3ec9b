"""Maya in ROS: the graph by the manual's names, nodes of ROS 1, and rosbridge. Built on `maya_un`."""
