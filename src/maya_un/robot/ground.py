"""Data of a machine that planning needs: from a controller, or from `controller.paper`."""

from __future__ import annotations

from typing import Protocol

from maya_un.config import Config
from maya_un.controller.inspection import Inspection
from maya_un.controller.protocol import Preview
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Route


class PlanningMachine(Protocol):
    """The machine for planning: a controller, or `controller.paper`."""

    @property
    def config(self) -> Config:
        """The machine's constants."""
        ...

    @property
    def mechanism(self) -> Mechanism:
        """Its geometry."""
        ...

    @property
    def workspace(self) -> Workspace:
        """Its workspace."""
        ...

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check and time `path` as a motion would."""
        ...

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`."""
        ...
