"""The planning of the controller layer without a controller: the preview equals the real motion.

In a worker (`maya_un.workers`) there is one, made by `prepare`; the functions of this module work on it there.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Generator
from typing import Any, TypeVar

from maya_un.config import Config
from maya_un.controller.inspection import Inspection
from maya_un.controller.planner import Jogging, MotionPlan, Planner
from maya_un.controller.protocol import Preview
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Route
from maya_un.schema.robot import Jogged
from maya_un.values import Joints

T = TypeVar("T")

_WORKSPACES = 4


class OfflineMachine:
    """A machine of `config` in a `workspace`, for planning without a controller."""

    def __init__(self, config: Config, workspace: Workspace, planner: Planner) -> None:
        self.config = config
        self.workspace = workspace
        self._planner = planner

    @property
    def mechanism(self) -> Mechanism:
        """Geometry of the machine."""
        return self.workspace.mechanism

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check and time `path` as a motion would; raises what the motion would raise."""
        return self._planner.preview(self.workspace, path, speed)

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`, None where it goes nowhere; raises as `preview` does."""
        return self._planner.inspect(self.workspace, path, speed, samples)


class PlannerCache:
    """Caches a planner, and the result of `made` for each recently used workspace."""

    def __init__(self, config: Config) -> None:
        self.config = config
        mechanism = Mechanism.of(config)
        self.planner = Planner(config, mechanism)
        self.jogging = Jogging(self.planner, mechanism)
        self._made: OrderedDict[tuple[object, Workspace], Any] = OrderedDict()

    def on(self, workspace: Workspace, made: Callable[[OfflineMachine], T]) -> T:
        """Return the result of `made` for a workspace, cached."""
        key = (made, workspace)
        found = self._made.pop(key, None)
        if found is None:
            found = made(OfflineMachine(self.config, workspace, self.planner))
        self._made[key] = found
        while len(self._made) > _WORKSPACES:
            self._made.popitem(last=False)
        return found


_drawers: list[PlannerCache] = []


def prepare(config: Config) -> None:
    """Create the cache of this process."""
    _drawers[:] = [PlannerCache(config)]


def drawer() -> PlannerCache:
    """Return the cache of this process."""
    return _drawers[0]


def plan(workspace: Workspace, route: Route, speed: float) -> Generator[None, None, MotionPlan]:
    """Return the plan of a route; raises as `Planner.plan` does."""
    yield
    return drawer().planner.plan(workspace, route, speed)


def jogged(workspace: Workspace, axis: str, here: Joints, way: float) -> Generator[None, None, Jogged]:
    """Return how far of a way along an axis the workspace allows; raises as `Jogging.within` does."""
    yield
    return drawer().jogging.within(workspace, axis, here, way)
