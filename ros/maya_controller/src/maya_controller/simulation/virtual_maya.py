"""The virtual twin, a DMC-41x3 with Maya's mechanics, for programs under the Python of nodes, in a running loop."""

from maya_un.assembly.controller import make_twin as virtual_maya

__all__ = ["virtual_maya"]
