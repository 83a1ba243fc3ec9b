"""Clients of the layers over a graph, with the same protocols as the layers themselves.

watch        state and events of the controller layer, and whether its nodes are alive
controller   the controller layer; previews are computed here
robot        the robot layer; plans of primitives are computed here
"""
