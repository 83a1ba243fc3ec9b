"""The layers of a stack that runs in another loop, for the servers of a graph in this loop.

State is read directly: states and workspaces are never changed, only replaced. Commands go through the bridge and its
gate, with their caller (`graph.permissions`). A tap transfers events and the state of the queue.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import TypeVar, cast

from maya_ros.graph.permissions import caller
from maya_ros.graph.table import POSITION
from maya_un.assembly.stack import Stack
from maya_un.events import Listener
from maya_un.http.bridge import Bridge
from maya_un.http.stream.hub import Batch, StreamSource
from maya_un.http.stream.topics import QUEUE
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Route
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import OnPhase
from maya_un.schema.jobs import QueueMode, QueueView
from maya_un.service.access.operations import LOCAL, Operation
from maya_un.service.service import Service
from maya_un.values import Joints, Progress, State, StopReport

T = TypeVar("T")

Work = Callable[[Service], Awaitable[T]]


class StackEvents:
    """Events of the stack, delivered in this loop; `view` is the latest known state of the queue."""

    def __init__(self, view: QueueView) -> None:
        self.view = view
        self._listeners: list[Listener] = []

    @contextmanager
    def listening(self, listener: Listener) -> Iterator[None]:
        """Call `listener` with every event while the block runs, in order."""
        self._listeners.append(listener)
        try:
            yield
        finally:
            self._listeners.remove(listener)

    def take(self, batch: Batch) -> None:
        """Take new events and a new state of the queue."""
        if QUEUE in batch.values:
            self.view = cast("QueueView", batch.values[QUEUE][LOCAL])
        for event in batch.events:
            for listener in tuple(self._listeners):
                listener(event)


@asynccontextmanager
async def echoed(bridge: Bridge, speed: float) -> AsyncIterator[StackEvents]:
    """Yield the events of the stack while the block runs; `speed` is how fast its clock runs."""

    async def begun(service: Service) -> tuple[Service, int, QueueView]:
        return service, (await service.status()).last_event, service.queue.view()

    loop = asyncio.get_running_loop()
    service, last, view = await bridge.asked(begun)
    echo = StackEvents(view)

    def hand_over(batch: Batch) -> None:
        loop.call_soon_threadsafe(echo.take, batch)

    tap = StreamSource(service, hand_over, speed)
    tap.topics[QUEUE].wanted = frozenset({LOCAL})
    tapping = loop.create_task(bridge.within(lambda: tap.run(last)), name="tap of the graph")
    try:
        yield echo
    finally:
        tapping.cancel()
        await asyncio.gather(tapping, return_exceptions=True)


class ControllerProxy:
    """The controller layer, for its server and for that of the sensors."""

    def __init__(self, stack: Stack, bridge: Bridge, echo: StackEvents) -> None:
        self._stack = stack
        self._bridge = bridge
        self.events = echo

    @property
    def state(self) -> State:
        """Latest state."""
        return self._stack.controller.state

    @property
    def workspace(self) -> Workspace:
        """The workspace; its strokes are the measured ones once the robot is homed."""
        return self._stack.controller.workspace

    @property
    def stops(self) -> int:
        """Number of stops and aborts so far."""
        return self._stack.controller.stops

    async def watch(self) -> AsyncIterator[State]:
        """Yield the state now and newer ones, checked twice as often as positions are published."""
        shown: State | None = None
        while True:
            if self.state is shown:
                await asyncio.sleep(0.5 / POSITION.rate)
            else:
                shown = self.state
                yield shown

    def progress(self) -> Progress | None:
        """Progress of the motion under way, None at rest."""
        return self.state.progress

    async def home(self) -> None:
        """Find the switches."""
        await self._call(Operation.COMMAND, lambda service: service.direct.home(), "home")

    async def move(self, target: Joints) -> None:
        """Go to joints (rad, m, m)."""
        await self._call(Operation.COMMAND, lambda service: service.direct.move(target), "move")

    async def follow(self, path: Route, *, speed: float = 1.0) -> None:
        """Follow a path that starts at the robot's position."""
        await self._call(Operation.COMMAND, lambda service: service.direct.follow(path, speed=speed), "follow")

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper."""
        await self._call(Operation.COMMAND, lambda service: service.direct.gripper(open_), "gripper")

    async def output(self, number: int, *, on: bool) -> None:
        """Switch a digital output of the controller."""
        await self._call(Operation.COMMAND, lambda service: service.direct.output(number, on=on), "output")

    async def stop(self) -> StopReport:
        """Begin to brake at once, on the path."""
        return await self._call(Operation.STOP, lambda service: service.stop())

    async def abort(self) -> None:
        """Stop without deceleration."""
        await self._call(Operation.ABORT, lambda service: service.abort())

    async def pause(self) -> StopReport:
        """Brake on the path and hold all motion."""
        return await self._call(Operation.PAUSE, lambda service: service.pause())

    async def resume(self) -> None:
        """Continue motion after a pause."""
        await self._call(Operation.RESUME, lambda service: service.resume())

    async def recover(self) -> None:
        """Clear a fault."""
        await self._call(Operation.RECOVER, lambda service: service.recover())

    async def override(self, ratio: float) -> None:
        """Scale the speed of all motion."""
        await self._call(Operation.SPEED, lambda service: service.speed(ratio), f"{ratio}")

    async def _call(self, operation: Operation, work: Work[T], subject: str = "") -> T:
        return await self._bridge.carry(caller(), operation, work, subject)


class RobotProxy:
    """The robot layer, for its server."""

    def __init__(self, stack: Stack, bridge: Bridge, echo: StackEvents) -> None:
        self._stack = stack
        self._bridge = bridge
        self._echo = echo

    @property
    def state(self) -> State:
        """Latest state."""
        return self._stack.controller.state

    @property
    def can_teleop(self) -> bool:
        """Whether the robot can take a command, and neither the queue nor a direct command uses it."""
        view = self._echo.view
        queued = view.running is not None or (bool(view.waiting) and view.mode is QueueMode.RUNNING)
        return self._stack.robot.can_teleop and not queued and not self._stack.service.direct.doing

    def progress(self) -> Progress | None:
        """Progress of the motion under way, None at rest."""
        return self.state.progress

    async def run(self, primitive: Primitive, on_phase: OnPhase | None = None) -> None:
        """Execute a primitive; its phases are reported in this loop."""
        loop = asyncio.get_running_loop()

        def told(phase: str) -> None:
            if on_phase is not None:
                loop.call_soon_threadsafe(on_phase, phase)

        async def work(service: Service) -> None:
            await service.direct.primitive(primitive, told)

        await self._bridge.carry(caller(), Operation.COMMAND, work, primitive.command)
