"""Checks whether a controller behaves as a DMC-41x3: conversations with the answers that this family gives.

The table (`table/*.json`) is written from Galil's command reference and from what independent clients of the
controller rely on. It tests the virtual controller and can test a real one.
"""

from dmc41x3.conformance.runner import ControllerChannel, VectorDifference, run
from dmc41x3.conformance.vectors import Demand, Vector, load

__all__ = ["ControllerChannel", "Demand", "Vector", "VectorDifference", "load", "run"]
