"""How long motions take, computed in a worker process, so that a long path does not block a server's loop."""

from __future__ import annotations

from collections.abc import Generator
from typing import Protocol

from maya_ros.graph.conversions import MotionPreviewer, speeds_for
from maya_ros.graph.permissions import caller
from maya_un.controller.planner import LEAST_SPEED, drawer, require_size
from maya_un.controller.protocol import Preview
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Path, Route
from maya_un.service.computing import Computing


class TimedRobot(Protocol):
    """The part of a controller layer that determines how long a motion takes."""

    @property
    def workspace(self) -> Workspace:
        """The workspace; its strokes are the measured ones once the robot is homed."""
        ...

    def allowed(self, speed: float) -> float:
        """Return the share of the speeds with which a motion may run that was requested with `speed`."""
        ...

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check `path` and return the preview of the motion; sends nothing."""
        ...


class MotionTimer:
    """Checks and times motions of `robot` in the workers of `computing`; without workers, in the running loop.

    Every user of the graph may have a few requests there at once. Each method raises the errors of the motion, and
    with workers `TooMuchAsked`, `TakesTooLong`, `TooLarge` and `WorkerFailed`.
    """

    def __init__(self, robot: TimedRobot, computing: Computing) -> None:
        self._robot = robot
        self._computing = computing

    async def duration(self, path: Path) -> float:
        """Return how long the motion along `path` takes at full speed [s]."""
        require_size(path)
        if self._computing.workers is None:
            return self._robot.preview(path).duration
        return await self._computing.value(caller(), _duration, self._robot.workspace, self._share, path)

    async def speed_for(self, path: Path, least: float) -> float:
        """Return the speed at which the motion along `path` takes at least `least` [s]; see `conversions.speeds_for`.

        Without a least duration, this neither computes nor waits.
        """
        if least <= 0.0:
            return 1.0
        require_size(path)
        if self._computing.workers is None:
            return await self._computing.value(caller(), speeds_for, self._robot.preview, path, least)
        return await self._computing.value(caller(), _speed, self._robot.workspace, self._share, path, least)

    @property
    def _share(self) -> float:
        return self._robot.allowed(1.0)


def _previewer(workspace: Workspace, share: float) -> MotionPreviewer:
    """Return the previews of this worker's planner, for a robot that moves with a `share` of its speeds."""

    def preview(path: Route, *, speed: float = 1.0) -> Preview:
        allowed = speed if share == 1.0 else max(LEAST_SPEED, speed * share)
        return drawer().planner.preview(workspace, path, allowed)

    return preview


def _duration(workspace: Workspace, share: float, path: Path) -> Generator[None, None, float]:
    yield
    return _previewer(workspace, share)(path).duration


def _speed(workspace: Workspace, share: float, path: Path, least: float) -> Generator[None, None, float]:
    yield
    return (yield from speeds_for(_previewer(workspace, share), path, least))
