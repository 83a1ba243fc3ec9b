"""`maya up`: keep a robot running in this thread, and its HTTP door in another."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from maya_un.address import SIM
from maya_un.assembly import Stack, stack
from maya_un.cli import output, runtime
from maya_un.cli.configure import configuration, taught_places
from maya_un.cli.quantities import clock_factor, host_and_port, target_address
from maya_un.cli.settings import Settings
from maya_un.cli.signals import asked_to_end
from maya_un.cli.twin import on_the_table, require_twin
from maya_un.cli.words import word
from maya_un.config import Config
from maya_un.errors import MayaError
from maya_un.loops import ScaledLoop, run
from maya_un.server.app import create_app
from maya_un.server.bridge import Bridge
from maya_un.server.crash import keep_quiet
from maya_un.server.thread import bound_socket, served
from maya_un.values import Mode, Point

PORT = 4133
"""The usual port of the HTTP door on loopback."""

_MOVING = {Mode.MOVING, Mode.HOMING, Mode.STOPPING}


class Options(NamedTuple):
    """What `maya up` was asked for; `table` is a job file whose parts stand on the twin's table."""

    address: str = SIM
    speed: float | None = None
    port: int = PORT
    seed: int | None = None
    table: str | None = None
    skip_home: bool = False


class _Robot(NamedTuple):
    """What to run: where, how fast its clock, what stands on the twin's table, whether to take over a homing.

    Taught places are kept in the file `places`.
    """

    config: Config
    address: str
    speed: float
    seed: int
    parts: dict[str, Point]
    skip_home: bool
    places: Path


def up(options: Options, settings: Settings) -> int:
    """Run until Ctrl-C or SIGTERM; stop on the path if moving, give the link back, remove the runtime file.

    Raises what starting raises: `AlreadyRunning`, `AddressInUse`, `ConnectFailed` and its kin.
    """
    config = configuration(settings)
    address = target_address(options.address, config.controller.address)
    speed = clock_factor(options.speed, address)
    require_twin(address, "maya up", seed=options.seed, table=options.table)
    parts = on_the_table(options.table, config, settings)
    robot = _Robot(config, address, speed, options.seed or 0, parts, options.skip_home, taught_places(settings))
    clock: Callable[[], asyncio.AbstractEventLoop] | None = (lambda: ScaledLoop(speed)) if address == SIM else None
    with runtime.claimed(), bound_socket(options.port) as door:
        run(_serve(robot, door, settings), clock)
    return output.DONE


async def _serve(robot: _Robot, door: socket.socket, settings: Settings) -> None:
    keep_quiet(asyncio.get_running_loop())
    async with stack(
        robot.config,
        robot.address,
        seed=robot.seed,
        parts=robot.parts,
        speed=robot.speed,
        places=robot.places,
    ) as running:
        refusal = await _refusal_to_skip_home(running) if robot.skip_home else None
        async with served(create_app(_bridge(running)), door) as url:
            controller = None if robot.address == SIM else host_and_port(robot.address)
            runtime.publish(runtime.Running(url, os.getpid(), controller))
            _announce(url, robot, refusal, settings)
            await asked_to_end()
        if not settings.json:
            output.say(word("ending", settings.language))
        await _come_to_rest(running)


def _bridge(running: Stack) -> Bridge:
    twin = running.twin
    parts = None if twin is None else lambda: {name: Point(*place) for name, place in twin.mechanics.parts.items()}
    return Bridge(asyncio.get_running_loop(), running.service, parts)


async def _refusal_to_skip_home(running: Stack) -> MayaError | None:
    """Take over the homing whose mark stands in the controller; return why not, where it is refused."""
    try:
        await running.controller.skip_home()
    except MayaError as refusal:
        return refusal
    return None


def _announce(url: str, robot: _Robot, refusal: MayaError | None, settings: Settings) -> None:
    if settings.json:
        code = 0 if refusal is None else refusal.code
        message = "" if refusal is None else refusal.text(settings.language)
        about = {"url": url, "pid": os.getpid(), "address": robot.address, "speed": robot.speed}
        output.emit({**about, "code": code, "message": message})
        return
    if refusal is not None:
        output.complain(refusal, settings)
    output.say(word("ready", settings.language, address=robot.address, speed=robot.speed, url=url))
    output.say(word("next", settings.language))


async def _come_to_rest(running: Stack) -> None:
    """Stop on the path and wait for it; a machine that cannot be told any more is left to itself."""
    if running.controller.state.mode not in _MOVING:
        return
    with suppress(MayaError, TimeoutError):
        report = await running.service.stop()
        async with asyncio.timeout(report.duration + 5.0):
            async for state in running.controller.watch():
                if state.mode not in _MOVING:
                    return
