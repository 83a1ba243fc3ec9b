"""A robot with its dashboard within this process: it is homed at once, and its twin can be looked at."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from dmc41x3.loops import ScaledLoop
from maya_un.assembly.controller import Twin
from maya_un.assembly.stack import Stack, stack, storage
from maya_un.assembly.staff import staffed
from maya_un.config import Config, load
from maya_un.dashboard.pages import add_dashboard
from maya_un.http import dates
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.thread import served
from maya_un.machine.log import MechanicsRecord
from maya_un.machine.truth import TrueConstants
from maya_un.recorder.store import RecordingStore
from maya_un.values import Point
from maya_un.workers import WorkerSet
from tests.calm import CALM_FILE
from tests.dashboard.services import SPEED, Service
from tests.homing_mark import stand_homed

T = TypeVar("T")

QUIET = 2.0
"""A robot that does not move for so long is at rest [s, its own clock]."""


@dataclass(frozen=True, slots=True)
class Options:
    """A robot: the speed of its clock, whether it is homed when it starts, and whether it has a journal and users.

    `truth` holds the true constants of its twin, and `parts` stand on the twin's table. Other computers would reach it
    at `addresses`.
    """

    speed: float = SPEED
    homed: bool = True
    stored: bool = False
    truth: TrueConstants | None = None
    parts: Mapping[str, Point] | None = None
    addresses: tuple[str, ...] = ()


class TwinService(Service):
    """A robot whose twin, the physical truth, can be asked. Its configuration, poses and journal are in its folder."""

    def __init__(self, folder: Path, options: Options) -> None:
        super().__init__(folder)
        self.file = folder / "maya.toml"
        self._options = options
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stack: Stack | None = None
        self._over: asyncio.Event | None = None

    def start(self) -> None:
        """Start it with the configuration in its file, and return when it answers."""
        if not self.file.exists():
            self.file.write_text(CALM_FILE.read_text(encoding="utf-8"), encoding="utf-8")
        started: Future[None] = Future()
        self._thread = threading.Thread(target=self._run, args=(load(self.file), started), name="a robot")
        self._thread.start()
        started.result(60.0)

    def kill(self) -> None:
        """End it."""
        loop, over = self._loop, self._over
        if self._thread is None or loop is None or over is None:
            return
        loop.call_soon_threadsafe(over.set)
        self._thread.join()
        self._thread = None

    def do(self, work: Callable[[Stack], Awaitable[T]]) -> T:
        """Return what `work` answers in the robot's loop."""
        robot, loop = self._stack, self._loop
        assert robot is not None
        assert loop is not None

        async def done() -> T:
            return await work(robot)

        return asyncio.run_coroutine_threadsafe(done(), loop).result(60.0)

    def truth(self, look: Callable[[Twin], T]) -> T:
        """Return what the mechanics of this instant show."""

        async def looked(robot: Stack) -> T:
            assert robot.twin is not None
            robot.twin.mechanics.advance(asyncio.get_running_loop().time())
            return look(robot.twin)

        return self.do(looked)

    def record(self, look: Callable[[MechanicsRecord], T]) -> T:
        """Return what the record of the mechanics shows; nothing but the mechanics writes it."""
        return self.truth(lambda twin: look(twin.mechanics.record))

    @property
    def gripper(self) -> Point:
        """The true place of the gripper [m]."""
        return self.truth(lambda twin: Point(*twin.mechanics.gripper_point()))

    def require_rest(self) -> None:
        """Wait until the robot is at rest. Then its true joints must keep their place for two seconds of its clock."""
        super().require_rest()
        mark = self.record(lambda record: record.mark())
        self.at(self.state["time"] + QUIET)
        window = self.record(lambda record: record.since(mark))
        assert window.low == window.high

    def _run(self, config: Config, started: Future[None]) -> None:
        with asyncio.Runner(loop_factory=lambda: ScaledLoop(self._options.speed)) as runner:
            try:
                runner.run(self._serve(config, started))
            except BaseException as error:
                if not started.done():
                    started.set_exception(error)
                raise

    async def _serve(self, config: Config, started: Future[None]) -> None:
        options = self._options
        with staffed(config) as staff:
            async with self._assembled(config, staff) as robot, self._served(config, robot):
                if options.homed:
                    await stand_homed(robot)
                self._over = asyncio.Event()
                started.set_result(None)
                await self._over.wait()
                await robot.process.close()

    @asynccontextmanager
    async def _assembled(self, config: Config, staff: WorkerSet) -> AsyncIterator[Stack]:
        options = self._options
        async with (
            storage(self.folder / "maya.db" if options.stored else None, config.storage) as kept,
            stack(
                config,
                parts=options.parts,
                truth=options.truth,
                speed=options.speed,
                places=self.folder / "poses.toml",
                config_file=self.file,
                journal=kept.journal,
                calendar=dates,
                users=kept.users,
                recordings=RecordingStore.of(config.recorder, self.folder / "recordings", time.time_ns),
                staff=staff,
            ) as robot,
        ):
            yield robot

    @asynccontextmanager
    async def _served(self, config: Config, robot: Stack) -> AsyncIterator[None]:
        self._loop, self._stack = asyncio.get_running_loop(), robot
        gate, callers = robot.gate, robot.access.callers
        bridge = Bridge(self._loop, robot.service, gate=gate, callers=callers, journal=robot.journal)
        app = create_app(bridge, addresses=self._options.addresses)
        add_dashboard(app, config.camera.url)
        with bound_socket(self.port) as listener:
            async with served(app, listener):
                yield


@contextmanager
def twin_service(folder: Path, options: Options | None = None) -> Iterator[TwinService]:
    """Run a robot within this process while the block runs."""
    made = TwinService(folder, options or Options())
    try:
        made.start()
        yield made
    finally:
        made.kill()
