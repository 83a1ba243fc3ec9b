"""`maya up`: keep a robot running in this thread, and its HTTP door in another."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from maya_un.assembly import SIM, Stack, stack
from maya_un.cli import output, runtime
from maya_un.cli.configure import configuration
from maya_un.cli.quantities import clock_factor, host_and_port, target_address
from maya_un.cli.settings import Settings
from maya_un.cli.signals import asked_to_end
from maya_un.cli.words import word
from maya_un.config import Config
from maya_un.errors import MayaError
from maya_un.loops import ScaledLoop, run
from maya_un.process.files import load_job
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
    seed: int = 0
    table: str | None = None


class _Robot(NamedTuple):
    """What to run: where, how fast its clock, and what stands on the twin's table."""

    config: Config
    address: str
    speed: float
    seed: int
    parts: dict[str, Point]


def up(options: Options, settings: Settings) -> int:
    """Run until Ctrl-C or SIGTERM; stop on the path if moving, give the link back, remove the runtime file.

    Raises what starting raises: `AlreadyRunning`, `AddressInUse`, `ConnectFailed` and its kin.
    """
    address = target_address(options.address)
    speed = clock_factor(options.speed, address)
    config = configuration(settings)
    parts = {} if options.table is None else load_job(Path(options.table)).part_points(config.cell.grasp_height)
    clock: Callable[[], asyncio.AbstractEventLoop] | None = (lambda: ScaledLoop(speed)) if address == SIM else None
    with runtime.claimed(), bound_socket(options.port) as door:
        run(_serve(_Robot(config, address, speed, options.seed, parts), door, settings), clock)
    return output.DONE


async def _serve(robot: _Robot, door: socket.socket, settings: Settings) -> None:
    keep_quiet(asyncio.get_running_loop())
    async with stack(robot.config, robot.address, seed=robot.seed, parts=robot.parts, speed=robot.speed) as running:
        async with served(create_app(_bridge(running)), door) as url:
            controller = None if robot.address == SIM else host_and_port(robot.address)
            runtime.publish(runtime.Running(url, os.getpid(), controller))
            _announce(url, robot, settings)
            await asked_to_end()
        if not settings.json:
            output.say(word("ending", settings.language))
        await _come_to_rest(running)


def _bridge(running: Stack) -> Bridge:
    twin = running.twin
    parts = None if twin is None else lambda: {name: Point(*place) for name, place in twin.mechanics.parts.items()}
    return Bridge(asyncio.get_running_loop(), running.service, parts)


def _announce(url: str, robot: _Robot, settings: Settings) -> None:
    if settings.json:
        output.emit({"url": url, "pid": os.getpid(), "address": robot.address, "speed": robot.speed})
        return
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
