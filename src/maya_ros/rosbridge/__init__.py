"""The rosbridge endpoint: protocol version 2 over any graph, with or without ROS.

incoming, outgoing          messages of a client, checked; messages to a client in their forms
topics, services, actions   one part of a session each
client, session             shared by these parts; one client, whose messages are carried out in order
rosapi                      services of rosapi about the graph
limits                      limits of the requests of a client
wire, endpoint              websockets: admission of clients, and bounds for slow readers
standalone, thread_proxy    the graph of `maya up --rosbridge`: servers on a bus in the loop of the HTTP server
"""
