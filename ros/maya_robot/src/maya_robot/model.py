"""The model of Maya for programs that run under the Python of the nodes."""

from maya_un.config import load
from maya_un.kinematics.workspace import Workspace


def model() -> Workspace:
    """Return the workspace of the configuration, in m and rad; its lengths are those of `mechanism`.

    The zones are those of the configuration, the strokes those before homing.
    """
    return Workspace.of(load())
