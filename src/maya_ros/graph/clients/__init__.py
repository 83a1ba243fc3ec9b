"""Layers on the other side of a graph, by the layers' own protocols: callers need not know which.

watch        state and events of the controller layer, and whether it is there
controller   the controller layer; previews are computed here
robot        the robot layer; plans of primitives are computed here
"""
