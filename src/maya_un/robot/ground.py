"""What planning needs to know of a machine: a controller tells it, or the paper of the controller floor."""

from __future__ import annotations

from typing import Protocol

from maya_un.config import Config
from maya_un.controller.inspection import Inspection
from maya_un.controller.protocol import Preview
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Route


class Ground(Protocol):
    """What is planned on: a controller, or paper."""

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
        """Where it can go."""
        ...

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check and time `path` as a motion would."""
        ...

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`."""
        ...
