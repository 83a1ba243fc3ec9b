"""The rosbridge endpoint: protocol version 2 over any graph, with or without ROS.

fields, names    what stands in a client's message, checked
fragments, png, forms, outgoing    the forms of a message on the wire
subscribing, publishing, calling, serving, sending, acting    one concern of a session each
session          one client: what it says is carried out in order, what fails is told as a status
rosapi           questions about the graph, as clients ask them
wire, endpoint   websockets: who is let in, how much a slow reader may owe
alone, near      the graph of `maya up --rosbridge`: the doors on a bus in the loop of the server
"""
