"""`maya up`: keep a robot running in this thread, and its HTTP door in another."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, ExitStack, asynccontextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dmc41x3.address import SIM
from dmc41x3.listening import reserve_descriptors
from dmc41x3.loops import ScaledLoop, run
from maya_un import runtime
from maya_un.assembly import Stack, stack, staffed, storage
from maya_un.cli import output
from maya_un.cli.coms.colocated import coms_beside
from maya_un.cli.configure import configuration, on_the_table, require_twin, taught_places
from maya_un.cli.quantities import clock_factor, host_and_port, target_address
from maya_un.cli.recordings.recordings import shelf
from maya_un.cli.service import shutdown
from maya_un.cli.service.banner import StartupBanner, greet
from maya_un.cli.service.listeners import RemoteAccess, require_users, rosbridge_at, url_of
from maya_un.cli.service.shutdown import ShutdownRequest, brought_to_rest
from maya_un.cli.settings import OutputSettings
from maya_un.config import Config
from maya_un.config.state_folder import own_state_folder
from maya_un.errors import MayaError
from maya_un.http import dates, log
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.listeners import PORT, ListeningSocket, bound_socket
from maya_un.http.log import keep_quiet
from maya_un.http.metrics import Metrics
from maya_un.http.thread import served
from maya_un.interpreter import prompt_loop
from maya_un.process.journal.file import remove_new, require_place
from maya_un.values import Point

if TYPE_CHECKING:
    from maya_un.edges import EndpointOptions

ROSBRIDGE_PORT = 9090
"""The usual port of rosbridge."""

MEMORY = "memory"
"""The journal that ends with the process."""


_FILES = 24
"""Number of files, about, that the service opens besides its connections: journal, locks, listeners, workers."""


class UpOptions(NamedTuple):
    """What `maya up` was asked for; `table` is a job file whose parts stand on the twin's table.

    `journal` is the file of the queue, "memory" for none, None for the usual one; `finish` ends the step under way
    before this program ends. `rosbridge` is the port of that endpoint, None for none. `take_over` takes the controller
    from another program that owns it. `coms` starts `maya coms` beside, which needs that endpoint.
    """

    address: str = SIM
    speed: float | None = None
    port: int = PORT
    seed: int | None = None
    table: str | None = None
    skip_home: bool = False
    journal: str | None = None
    finish: bool = False
    remote: RemoteAccess = RemoteAccess()
    rosbridge: int | None = None
    take_over: bool = False
    coms: bool = False


class _Robot(NamedTuple):
    """What to run: where, how fast its clock, what stands on the twin's table, whether to take over a homing or more.

    Taught places are kept in the file `places`, the queue in the file `journal`, None for memory.
    """

    config: Config
    address: str
    speed: float
    seed: int
    parts: dict[str, Point]
    skip_home: bool
    places: Path
    journal: Path | None
    take_over: bool


class _UpListeners(NamedTuple):
    """Where is served: HTTP on loopback, to other machines, and rosbridge; None for what is not."""

    near: socket.socket
    far: ListeningSocket | None
    rosbridge: EndpointOptions | None


def up(options: UpOptions, settings: OutputSettings) -> int:
    """Run until Ctrl-C or SIGTERM; come to rest, give the link back, remove the runtime file.

    Raises what starting raises: `AlreadyRunning`, `AddressInUse`, `StorageInUse`, `ConnectFailed` and their kin.
    """
    reserve_descriptors(own=_FILES)
    prompt_loop()
    options.remote.check()
    config = configuration(settings)
    address = target_address(options.address, config.controller.address)
    speed = clock_factor(options.speed, address)
    require_twin(address, "maya up", seed=options.seed, table=options.table)
    parts = on_the_table(options.table, config, settings)
    places, journal = taught_places(settings), journal_file(options.journal)
    robot = _Robot(
        config, address, speed, options.seed or 0, parts, options.skip_home, places, journal, options.take_over
    )
    clock: Callable[[], asyncio.AbstractEventLoop] | None = (lambda: ScaledLoop(speed)) if address == SIM else None
    with runtime.claimed(), log.kept(), ExitStack() as doors:
        near = doors.enter_context(bound_socket(options.port))
        far = options.remote.door()
        if far is not None:
            doors.enter_context(far.socket)
        rosbridge = doors.enter_context(rosbridge_at(options.rosbridge, journal, options.remote))
        if rosbridge is not None:
            robot = robot._replace(config=_configured(config, speed))
            if options.coms:
                doors.enter_context(coms_beside(url_of(rosbridge), config.coms))
        run(_serve(robot, options, _UpListeners(near, far, rosbridge), settings), clock)
    return output.DONE


def journal_file(named: str | None) -> Path | None:
    """Return the file of the queue: `maya.db` in the folder of state where none is `named`, None for "memory"."""
    if named == MEMORY:
        return None
    if named is None:
        return own_state_folder() / "maya.db"
    require_place(Path(named))
    return Path(named)


async def _serve(robot: _Robot, options: UpOptions, doors: _UpListeners, settings: OutputSettings) -> None:
    keep_quiet(asyncio.get_running_loop())
    metrics = Metrics()
    async with _running(robot) as running:
        require_users(kept=running.entrance.callers.kept, listen=options.remote.listen)
        running.controller.events.heard_by(metrics.happened)
        running.controller.events.heard_by(log.note_event)
        running.controller.tap(metrics.timer(robot.speed))
        refusal = await _refusal_to_skip_home(running) if robot.skip_home else None
        bridge = _bridge(running)
        app = create_app(bridge, options.remote.edge(), metrics)
        ending = ShutdownRequest(finish=options.finish)
        far = () if doors.far is None else (doors.far,)
        beside = partial(_beside, running, bridge, doors.rosbridge, robot.speed)
        async with served(app, doors.near, *far, beside=beside) as url, _looked_after(robot.speed, metrics):
            with ending.listening():
                controller = None if robot.address == SIM else host_and_port(robot.address)
                runtime.publish(runtime.Running(url, os.getpid(), controller))
                greet(_greeting(running, robot, url, doors, refusal), settings)
                shutdown.tell("READY=1")
                await ending.asked.wait()
                shutdown.tell("STOPPING=1")
                await brought_to_rest(running, ending, settings)


@asynccontextmanager
async def _running(robot: _Robot) -> AsyncIterator[Stack]:
    """Wire the stack on its journal and close the journal last; remove a new journal if the start fails."""
    new = robot.journal is not None and not robot.journal.exists()
    started = False
    try:
        with staffed(robot.config) as staff:
            async with (
                storage(robot.journal, robot.config.storage) as kept,
                stack(
                    robot.config,
                    robot.address,
                    seed=robot.seed,
                    parts=robot.parts,
                    speed=robot.speed,
                    take_over=robot.take_over,
                    places=robot.places,
                    journal=kept.journal,
                    calendar=dates,
                    users=kept.users,
                    recordings=shelf(robot.config.recorder),
                    staff=staff,
                ) as running,
            ):
                started = True
                yield running
    finally:
        if robot.journal is not None and new and not started:
            remove_new(robot.journal)


@asynccontextmanager
async def _looked_after(speed: float, metrics: Metrics) -> AsyncIterator[None]:
    """Watch the running loop, and tell the supervisor that it lives."""
    tasks = [asyncio.create_task(metrics.watch_loop(speed)), asyncio.create_task(shutdown.stay_alive(speed))]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _beside(
    running: Stack, bridge: Bridge, rosbridge: EndpointOptions | None, speed: float
) -> AbstractAsyncContextManager[object]:
    """Return what is served beside HTTP."""
    if rosbridge is None:
        return nullcontext()
    from maya_un.edges import edge

    return edge("rosbridge").endpoint(running, bridge, rosbridge, speed=speed)


def _configured(config: Config, speed: float) -> Config:
    from maya_un.edges import edge

    return edge("rosbridge").configured(config, speed)


def _greeting(running: Stack, robot: _Robot, url: str, doors: _UpListeners, refusal: MayaError | None) -> StartupBanner:
    remote = None if doors.far is None else doors.far.url
    rosbridge = None if doors.rosbridge is None else url_of(doors.rosbridge)
    queue = running.service.queue.view()
    return StartupBanner(url, remote, robot.address, robot.speed, robot.journal, queue, refusal, rosbridge)


def _bridge(running: Stack) -> Bridge:
    twin = running.twin
    parts = None if twin is None else lambda: twin.parts
    return Bridge(
        asyncio.get_running_loop(),
        running.service,
        parts,
        gate=running.gate,
        callers=running.entrance.callers,
        journal=running.journal,
    )


async def _refusal_to_skip_home(running: Stack) -> MayaError | None:
    """Take over the homing whose mark stands in the controller; return why not, where it is refused."""
    try:
        await running.controller.skip_home()
    except MayaError as refusal:
        return refusal
    return None
