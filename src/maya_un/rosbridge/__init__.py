"""The rosbridge endpoint: protocol version 2 over any graph, with or without ROS."""
