"""Helpers for tests of Maya and of its users: a controller layer on a twin with a chosen machine and start."""

from dmc41x3.loops import run_virtual
from maya_un.testing.rig import Rig, rig

__all__ = ["Rig", "rig", "run_virtual"]
