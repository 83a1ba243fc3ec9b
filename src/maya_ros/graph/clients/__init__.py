"""Floors on the other side of a graph, by the floors' own protocols: who uses them cannot tell.

watch        what the controller floor tells: its state, its events, whether it is there at all
controller   the controller floor; what only needs to be worked out is worked out here
robot        the robot floor; what a primitive would be is worked out here
vias         when the waypoints of a path are passed, by where the robot says it is
urgent       stops, said also to a node that hangs
stopping     what goes by several wishes is stopped between two of them as well
asking       wishes: what goes wrong there is raised here, with the code and words of the floor that said it
"""
