"""Helpers for tests, ours and users': a controller layer on a twin whose machine and start the test chooses."""

from dmc41x3.loops import run_virtual
from maya_un.testing.rig import Rig, rig

__all__ = ["Rig", "rig", "run_virtual"]
