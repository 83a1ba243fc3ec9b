"""Is it a DMC-41x3? Conversations and the answers that a controller of this family gives, to be held against any.

The table (`table/*.json`) is written from Galil's command reference and from what independent clients of the
controller rely on; the virtual controller is tested by it and so can a real one be.
"""

from dmc41x3.conformance.runner import ControllerChannel, VectorDifference, run
from dmc41x3.conformance.vectors import Demand, Vector, load

__all__ = ["ControllerChannel", "Demand", "Vector", "VectorDifference", "load", "run"]
