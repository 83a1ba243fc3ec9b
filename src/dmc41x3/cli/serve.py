"""`dmc serve`: a virtual controller for any client of a DMC-41x3."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from dmc41x3.address import split
from dmc41x3.cli import console
from dmc41x3.cli.console import OutputSettings, clock_factor
from dmc41x3.cli.signals import asked_to_end
from dmc41x3.errors import FileUnwritable, InvalidValue
from dmc41x3.files import writable_place
from dmc41x3.listening import reserve_descriptors
from dmc41x3.loops import ScaledLoop, run
from dmc41x3.twin.memory import Memory
from dmc41x3.twin.wire.server import bench
from dmc41x3.wire.bootp import SERVER_PORT


class BenchOptions(NamedTuple):
    """The options of the command line. `speed` is None if the line has none."""

    host: str
    port: int
    also_ports: Sequence[int] = ()
    udp: bool = True
    axes: int = 3
    memory: str | None = None
    firmware: str | None = None
    speed: float | None = None
    serial: bool = False
    bootp: str | None = None


def serve(options: BenchOptions, settings: OutputSettings) -> int:
    """Serve a virtual controller until Ctrl-C or SIGTERM; print its address once it listens.

    Raises `AddressInUse`, `FileUnwritable` and `InvalidValue`.
    """
    memory = burned(options.memory)
    require_line(options.firmware)
    reserve_descriptors()
    factor = clock_factor(options.speed)
    run(_serve(options, memory, settings), lambda: ScaledLoop(factor))
    return console.DONE


def burned(file: str | None) -> Memory:
    """Return the memory stored in `file`, or a volatile memory for None; raises `FileUnwritable`."""
    if file is None:
        return Memory(None)
    path = Path(file).absolute()
    if not os.access(path.parent, os.W_OK):
        raise FileUnwritable(path=file, reason="its folder does not exist or is not writable")
    writable_place(path)
    return Memory(path)


def require_line(firmware: str | None) -> None:
    """Raise `InvalidValue` if an answer to ^R^V is not a line in ASCII."""
    if firmware is not None and not (firmware.isascii() and firmware.isprintable()):
        raise InvalidValue(key="--firmware", value=firmware, reason="it must be a line in ASCII")


def bootp_server(text: str) -> tuple[str, int]:
    """Return host and port of a BOOTP or DHCP server; raises `InvalidValue`."""
    try:
        host, port = split(text)
    except ValueError as error:
        raise InvalidValue(key="--bootp", value=text, reason=str(error)) from error
    return host, port if ":" in text else SERVER_PORT


async def _serve(options: BenchOptions, memory: Memory, settings: OutputSettings) -> None:
    controller = bench(options.axes, memory, options.firmware)
    try:
        host, port = await controller.serve(options.host, options.port, udp=options.udp)
        for also in options.also_ports:
            await controller.serve(options.host, also, udp=options.udp)
        address = f"{host}:{port}"
        also = [f"{host}:{also}" for also in options.also_ports]
        serial = controller.serve_serial() if options.serial else None
        if options.bootp is not None:
            controller.ask_for_address(bootp_server(options.bootp))
        value = {"address": address, "also": also, "udp": options.udp, "serial": serial, "pid": os.getpid()}
        console.answer(value, "\n".join(filter(None, (address, serial))), settings)
        await asked_to_end()
    finally:
        await controller.close()
