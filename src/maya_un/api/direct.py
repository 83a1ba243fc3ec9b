"""Direct commands for callers who do not queue: one at a time, and refused while anything else runs.

The queue waits meanwhile: a job begins when the direct command has ended. A command is refused with `Busy` while a job
or another command is running. Callers have passed the gate by `Operation.WISH`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import Any

from maya_un.cancellation import cancel_once, is_caller_cancelled, run_to_rest
from maya_un.controller.protocol import Controller
from maya_un.controller.run import OnVia
from maya_un.errors import Busy, Cancelled, NotConnected
from maya_un.motion.path import Route
from maya_un.process.process import Process
from maya_un.robot.primitives import Primitive
from maya_un.robot.protocol import OnPhase, Robot
from maya_un.values import Joints


class DirectCommands:
    """Carries out direct commands past the queue of `process`; `halt_jogs` stops held jogs.

    Every command raises the errors of its layer. Cancelling it stops on the path.
    """

    def __init__(self, process: Process, robot: Robot, controller: Controller, halt_jogs: Callable[[], None]) -> None:
        self._process = process
        self._robot = robot
        self._controller = controller
        self._halt_jogs = halt_jogs
        self._doing = ""
        self._task: asyncio.Task[None] | None = None

    @property
    def doing(self) -> str:
        """The running command, or ""."""
        return self._doing

    def require_free(self) -> None:
        """Raise `Busy` while a direct command is running."""
        if self._doing:
            raise Busy(doing=self._doing)

    async def home(self) -> None:
        """Find the switches, define the counts, measure the strokes."""
        await self._do("home", self._controller.home())

    async def move(self, target: Joints) -> None:
        """Go to `target` (rad, m, m), straight in the joints."""
        await self._do("move", self._controller.move(target))

    async def follow(self, path: Route, *, speed: float = 1.0, on_via: OnVia | None = None) -> None:
        """Go along `path`, whose first point is where the robot is."""
        await self._do("follow", self._controller.follow(path, speed=speed, on_via=on_via))

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper."""
        await self._do("gripper", self._controller.gripper(open_))

    async def primitive(self, primitive: Primitive, on_phase: OnPhase | None = None) -> None:
        """Do a primitive, and tell its phases."""
        await self._do(primitive.command, self._robot.run(primitive, on_phase))

    async def end_all(self) -> None:
        """Cancel every movement (of a job, a direct command, a homing or a jog) and all waiting jobs.

        It brakes at once; this returns when the robot is at rest and the queue is empty. A job that an earlier end of
        the program interrupted still waits for a person. Raises `StorageFailed`.
        """
        self._process.end_running()
        self._halt_jogs()
        cancel_once(self._task)
        try:
            with suppress(NotConnected):
                await self._controller.stop()
        finally:
            await self._process.end_all()
        if self._task is not None:
            await asyncio.wait({self._task})

    async def _do(self, name: str, work: Coroutine[Any, Any, None]) -> None:
        try:
            self.require_free()
            with self._process.turns.aside(name):
                await self._carried(name, work)
        finally:
            work.close()

    async def _carried(self, name: str, work: Coroutine[Any, Any, None]) -> None:
        """Carry out a command in a separate task; the caller returns when it has ended, cancelled or not."""
        self._doing = name
        self._task = task = asyncio.get_running_loop().create_task(work, name=f"direct {name}")
        try:
            await run_to_rest(task)
        except asyncio.CancelledError:
            if is_caller_cancelled():
                raise
            raise Cancelled from None
        finally:
            self._doing, self._task = "", None
