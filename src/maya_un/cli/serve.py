"""`maya dmc serve`: a virtual controller for anybody who speaks its language."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from maya_un.address import SIM
from maya_un.assembly import make_twin
from maya_un.cli import output
from maya_un.cli.configure import configuration
from maya_un.cli.quantities import clock_factor
from maya_un.cli.settings import Settings
from maya_un.cli.signals import asked_to_end
from maya_un.cli.twin import on_the_table
from maya_un.cli.twins import ServedTwin, published
from maya_un.errors import FileUnwritable, InvalidCommandLine, InvalidValue
from maya_un.loops import ScaledLoop, run
from maya_un.values import Point
from maya_un.virtual.bench import ServoBench
from maya_un.virtual.machine import VirtualDmc
from maya_un.virtual.memory import Memory
from maya_un.virtual.wire.control import HOST, ControlDoor
from maya_un.virtual.wire.server import VirtualController

_COMMAND = "maya dmc serve"
_MAYAS_AXES = 3


class Options(NamedTuple):
    """What the command line says. `axes` and `seed` are None where it says nothing."""

    host: str
    port: int
    also_ports: Sequence[int] = ()
    udp: bool = True
    axes: int | None = None
    bench: bool = False
    memory: str | None = None
    firmware: str | None = None
    speed: float | None = None
    seed: int | None = None
    table: str | None = None


def serve(options: Options, settings: Settings) -> int:
    """Serve a virtual controller until Ctrl-C or SIGTERM; prints where it listens once it does.

    Raises `AddressInUse`, `FileUnwritable`, `InvalidCommandLine` and `InvalidValue`.
    """
    _check(options)
    factor = clock_factor(options.speed, SIM)
    parts = on_the_table(options.table, configuration(settings), settings)
    run(_serve(options, parts, settings), lambda: ScaledLoop(factor))
    return output.DONE


def _check(options: Options) -> None:
    if options.axes not in {None, _MAYAS_AXES} and not options.bench:
        raise InvalidCommandLine(reason="Maya has three axes; --axes is for --bench", command=_COMMAND)
    if options.bench and options.table is not None:
        raise InvalidCommandLine(reason="there is no table on a bench", command=_COMMAND)
    if options.firmware is not None and not (options.firmware.isascii() and options.firmware.isprintable()):
        raise InvalidValue(key="--firmware", value=options.firmware, reason="it is a line in ASCII")
    if options.memory is not None:
        _check_memory(options.memory)


def _check_memory(text: str) -> None:
    path = Path(text).absolute()
    if not os.access(path.parent, os.W_OK):
        raise FileUnwritable(path=text, reason="its folder is not there or not ours to write to")
    if path.exists() and not path.is_file():
        raise FileUnwritable(path=text, reason="it is no file")


def _made(options: Options, parts: dict[str, Point]) -> VirtualController:
    memory = Memory(None if options.memory is None else Path(options.memory).absolute())
    if not options.bench:
        return make_twin(seed=options.seed or 0, parts=parts, memory=memory, firmware=options.firmware).controller
    axes = options.axes or _MAYAS_AXES
    machine = VirtualDmc(ServoBench(axes), axes=axes, memory=memory, firmware=options.firmware)
    return VirtualController(machine, seed=options.seed or 0)


async def _serve(options: Options, parts: dict[str, Point], settings: Settings) -> None:
    controller = _made(options, parts)
    door: ControlDoor | None = None
    try:
        host, port = await controller.serve(options.host, options.port, udp=options.udp)
        for also in options.also_ports:
            await controller.serve(options.host, also, udp=options.udp)
        door = await ControlDoor.opened(controller.faults)
        with published(ServedTwin(host, port, door.port, os.getpid())):
            _say(host, port, door.port, options, settings)
            await asked_to_end()
    finally:
        if door is not None:
            await door.close()
        await controller.close()


def _say(host: str, port: int, control: int, options: Options, settings: Settings) -> None:
    address = f"{host}:{port}"
    also = [f"{host}:{also}" for also in options.also_ports]
    value = {"address": address, "also": also, "udp": options.udp, "control": control, "pid": os.getpid()}
    output.answer(value, f"{address}\nmaya dmc fault: {HOST}:{control}", settings)
