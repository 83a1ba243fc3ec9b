"""A robot on the twin for many tests: its HTTP interface on a real socket, users of every role, a fast clock."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

from fastapi import FastAPI

from dmc41x3.loops import ScaledLoop
from maya_ros.edge import endpoint
from maya_un.assembly.stack import Stack, stack
from maya_un.edges import EndpointOptions, Ros2Options
from maya_un.http import dates
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.origins import OriginPolicy, Rate
from maya_un.http.sockets import bound_socket
from maya_un.http.thread import served
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.service.access.operations import Role
from maya_un.service.access.users import FileStore
from maya_un.values import Point
from tests.calm import CALM

T = TypeVar("T")

SPEED = 250.0
"""Speed of the twin's clock: the records and beats of a second cost a few milliseconds, also while the robot rests."""

PASSWORD = "correct horse battery"
"""Everybody's."""

_UNBOUNDED = Rate(1e6, 1e6)


@dataclass(slots=True)
class SharedRobot:
    """The robot: its URLs, also of rosbridge, its stack, a token of each role; "" for no user."""

    url: str
    app: FastAPI
    loop: asyncio.AbstractEventLoop
    stack: Stack
    over: asyncio.Event
    tokens: dict[str, str] = field(default_factory=dict[str, str])
    rosbridge: str = ""

    def do(self, work: Callable[[Stack], Awaitable[T]]) -> T:
        """Return what `work` answers in the robot's loop."""

        async def done() -> T:
            return await work(self.stack)

        return asyncio.run_coroutine_threadsafe(done(), self.loop).result(60.0)

    def headers(self, role: str) -> dict[str, str]:
        """Return what somebody of a role shows; nobody shows nothing."""
        token = self.tokens.get(role, "")
        return {"Authorization": f"Bearer {token}"} if token else {}


class _Kind(NamedTuple):
    """The properties of a shared robot."""

    users: bool
    homed: bool
    speed: float
    ros2: Ros2Options | None
    parts: Mapping[str, Point]


@contextmanager
def shared_robot(
    state: Path,
    *,
    users: bool,
    ros2: Ros2Options | None = None,
    speed: float = SPEED,
    homed: bool = True,
    parts: Mapping[str, Point] | None = None,
) -> Iterator[SharedRobot]:
    """Keep a robot running while the block runs, its journal in the folder `state`; with `users` of each role.

    With `ros2` it is in a graph of ROS 2 too. `speed` is the speed of its clock. `parts` stand on its table.
    """
    started: Future[SharedRobot] = Future()
    thread = threading.Thread(
        target=_run, args=(state, _Kind(users, homed, speed, ros2, parts or {}), started), name="shared robot"
    )
    thread.start()
    robot = started.result(60.0)
    try:
        yield robot
    finally:
        robot.loop.call_soon_threadsafe(robot.over.set)
        thread.join()


def _run(state: Path, kind: _Kind, started: Future[SharedRobot]) -> None:
    with asyncio.Runner(loop_factory=lambda: ScaledLoop(kind.speed)) as runner:
        try:
            runner.run(_serve(state, kind, started))
        except BaseException as error:
            if not started.done():
                started.set_exception(error)
            raise


async def _serve(state: Path, kind: _Kind, started: Future[SharedRobot]) -> None:
    loop, over = asyncio.get_running_loop(), asyncio.Event()
    file = state / "maya.db"
    journal = await SqliteJournal.open(file)
    try:
        async with stack(
            CALM, parts=kind.parts, speed=kind.speed, journal=journal, calendar=dates, users=FileStore(file)
        ) as running:
            gate, callers = running.gate, running.access.callers
            bridge = Bridge(loop, running.service, gate=gate, callers=callers, journal=journal)
            app = create_app(bridge, OriginPolicy(near=_UNBOUNDED))
            with bound_socket(0) as near, bound_socket(0) as listener:
                place = EndpointOptions(listener, OriginPolicy(near=_UNBOUNDED), state / "steps.db", kind.ros2)
                beside = partial(endpoint, running, bridge, place, speed=kind.speed)
                async with served(app, near, beside=beside) as url:
                    rosbridge = "ws://{}:{}".format(*listener.getsockname())
                    robot = SharedRobot(url, app, loop, running, over, rosbridge=rosbridge)
                    await _prepare(robot, kind)
                    started.set_result(robot)
                    await over.wait()
    finally:
        await journal.close()


async def _prepare(robot: SharedRobot, kind: _Kind) -> None:
    service = robot.stack.service
    await service.command({"command": "gripper", "open": True})
    if kind.homed:
        await service.command({"command": "home"})
    for role in reversed(Role) if kind.users else ():
        made = await service.users.add(f"the-{role.word}", role.word, PASSWORD)
        robot.tokens[role.word] = made.token
