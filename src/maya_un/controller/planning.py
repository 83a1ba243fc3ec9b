"""Plan motions of the controller layer in this process, or in a worker, so that planning never blocks the loop."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from math import inf
from typing import Any, TypeVar

from maya_un.controller import offline_planner
from maya_un.controller.command_slot import RunningCommand
from maya_un.controller.planner import Jogging, MotionPlan, Planner
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Route
from maya_un.schema.robot import Jogged
from maya_un.values import Joints
from maya_un.workers import Workers, WorkResult

T = TypeVar("T")

OWN = "motion"
"""Principal of the robot's own plans, for the worker's scheduler."""


class Planning:
    """Plans by `planner` and `jogging`, in `workers` if there are any."""

    def __init__(self, planner: Planner, jogging: Jogging, workers: Workers | None) -> None:
        self._planner = planner
        self._jogging = jogging
        self._workers = workers

    async def plan(self, wish: RunningCommand, workspace: Workspace, route: Route, speed: float) -> MotionPlan:
        """Return the plan of a route for `wish`; raises as `Planner.plan`, what ends the command, `WorkerFailed`."""
        if self._workers is None:
            return self._planner.plan(workspace, route, speed)
        return await _unless_ended(wish, self._workers.run(offline_planner.plan, workspace, route, speed, whose=OWN))

    async def jogged(self, wish: RunningCommand, workspace: Workspace, axis: str, here: Joints, way: float) -> Jogged:
        """Return how far a jog goes; raises as `Jogging.within`, what ends the command, `WorkerFailed`."""
        if self._workers is None:
            return self._jogging.within(workspace, axis, here, way)
        return await _unless_ended(
            wish, self._workers.run(offline_planner.jogged, workspace, axis, here, way, whose=OWN)
        )


async def _unless_ended(wish: RunningCommand, work: Coroutine[Any, Any, WorkResult[T]]) -> T:
    """Return the result of work; a stop does not wait for it."""
    task = asyncio.ensure_future(work)
    try:
        await wish.wait(inf, task)
        return task.result().value
    finally:
        task.cancel()
