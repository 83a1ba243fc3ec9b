"""Maya in a real ROS graph: the nodes of the manual, and `graph.protocol.Graph` by rospy; all that knows ROS."""
