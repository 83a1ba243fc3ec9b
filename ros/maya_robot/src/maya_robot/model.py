"""The model of Maya for programs that run under the Python of the nodes."""

from maya_un.config import load
from maya_un.kinematics.mechanism import Mechanism


def model() -> Mechanism:
    """Return the mechanism with the lengths of the configuration; its methods are in m and rad."""
    return Mechanism.of(load())
