"""The virtual twin: a DMC-41x3 with Maya's mechanics attached, for programs under the Python of the nodes; a loop must run."""

from maya_un.assembly import make_twin as virtual_maya

__all__ = ["virtual_maya"]
