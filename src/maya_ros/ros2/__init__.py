"""Maya in a ROS 2 graph, over DDS (Cyclone DDS from PyPI), without an installation of ROS 2.

names   names and qualities     types   the ROS 2 form of every type of the graph
dds     nodes, endpoints and discovery, as rmw_cyclonedds makes them
edge    topics, services and actions of one robot
"""
