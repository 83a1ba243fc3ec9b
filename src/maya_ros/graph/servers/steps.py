"""Steps of processes that others drive, on a graph: /step_command and /step_result."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager

from maya_ros.graph import diagnostics
from maya_ros.graph.permissions import Permit, anything
from maya_ros.graph.protocol import Graph
from maya_ros.graph.servers.tasks import Clock, clock_or_loop, diagnosed, tasks
from maya_ros.graph.steps import Steps, bridged
from maya_ros.graph.table import TASK
from maya_un.steps.store import StepStore


class TaskServer:
    """Has steps carried out by /task; `store` keeps which were, `date` tells the date (ISO 8601, UTC).

    `permit` raises where nobody may ask for a step; `name` is the robot's.
    """

    def __init__(
        self,
        store: StepStore,
        date: Callable[[], str],
        *,
        clock: Clock | None = None,
        speed: float = 1.0,
        permit: Permit = anything,
        name: str | None = None,
    ) -> None:
        self._permit = permit
        self._name = name
        self._store = store
        self._date = date
        self._clock = clock_or_loop(clock)
        self._speed = max(1.0, speed)

    @asynccontextmanager
    async def open(self, graph: Graph) -> AsyncGenerator[Steps]:
        """Listen while the block runs; the step under way is cancelled, and its result kept, before it is left."""
        task = graph.subscribe(f"{TASK.name}/status", "actionlib_msgs/GoalStatusArray", lambda _: None)

        def statuses() -> list[diagnostics.DiagnosticStatus]:
            return [diagnostics.bridge("firebase bridge", there=bool(task.writers))]

        async with (
            tasks() as working,
            bridged(graph, self._store, self._date, self._permit, name=self._name, speed=self._speed) as steps,
        ):
            working.begin(diagnosed(graph, statuses, self._clock, self._speed), "diagnostics")
            try:
                yield steps
            finally:
                task.close()
