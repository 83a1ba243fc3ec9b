"""`maya dmc`: a virtual controller on TCP, and a word with any controller in its own language."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import asdict

from maya_un.address import SIM, meant
from maya_un.assembly import make_twin
from maya_un.cli import output
from maya_un.cli.configure import configuration
from maya_un.cli.quantities import clock_factor, host_and_port
from maya_un.cli.settings import Settings
from maya_un.cli.signals import asked_to_end
from maya_un.cli.twin import on_the_table
from maya_un.galil.driver import Driver
from maya_un.galil.record import AxisRecord, DataRecord
from maya_un.galil.transport import TcpTransport
from maya_un.loops import ScaledLoop, run
from maya_un.values import Point

TIMEOUT = 5.0
"""Longest wait for a reply of a controller [s]."""


def serve(host: str, port: int, speed: float | None, seed: int, table: str | None, settings: Settings) -> int:
    """Serve the twin with Maya's mechanics until Ctrl-C or SIGTERM; prints its address once it listens.

    `seed` draws where it powers up; the parts of the job file `table` stand on its table. Raises `AddressInUse`.
    """
    factor = clock_factor(speed, SIM)
    parts = on_the_table(table, configuration(settings))
    run(_serve(host, port, seed, parts, settings), lambda: ScaledLoop(factor))
    return output.DONE


async def _serve(host: str, port: int, seed: int, parts: dict[str, Point], settings: Settings) -> None:
    twin = make_twin(seed=seed, parts=parts)
    try:
        found = await twin.controller.serve(host, port)
        address = f"{found[0]}:{found[1]}"
        output.answer({"address": address}, address, settings)
        await asked_to_end()
    finally:
        await twin.controller.close()


def send(address: str, commands: Sequence[str], settings: Settings) -> int:
    """Send commands one after the other and print their replies; ends at the first that is refused.

    Raises `ConnectFailed`, `LinkTimeout`, and `CommandRejected` with the controller's own code.
    """
    host, port = host_and_port(meant(address, configuration(settings).controller.address), "HOST")
    replies = asyncio.run(_converse(host, port, commands, settings))
    if settings.json:
        output.emit({"address": f"{host}:{port}", "replies": replies})
    return output.DONE


async def _converse(host: str, port: int, commands: Sequence[str], settings: Settings) -> list[dict[str, object]]:
    driver = await Driver.open(await TcpTransport.connect(host, port, TIMEOUT), timeout=TIMEOUT)
    replies: list[dict[str, object]] = []
    try:
        for command in commands:
            reply = await _reply(driver, command)
            record = isinstance(reply, DataRecord)
            replies.append({"command": command, "reply": asdict(reply) if record else reply})
            if not settings.json:
                output.say(_record_text(reply) if record else reply or ":")
    finally:
        await driver.close()
    return replies


async def _reply(driver: Driver, command: str) -> str | DataRecord:
    """Return a reply as text; QR answers with a record."""
    return await driver.record() if command.strip().upper() == "QR" else await driver.send(command)


def _record_text(record: DataRecord) -> str:
    """Return a record for people: one line an axis, in the controller's units."""
    return "\n".join(_axis_text(letter, axis) for letter, axis in zip("ABCDEFGH", record.axes, strict=False))


def _axis_text(letter: str, axis: AxisRecord) -> str:
    facts = {
        "moving": axis.moving,
        "motor off": axis.motor_off,
        "forward limit": axis.forward_limit_active,
        "reverse limit": axis.reverse_limit_active,
    }
    numbers = (
        f"{letter}  position {axis.position}  reference {axis.reference}  error {axis.error}  "
        f"velocity {axis.velocity:g}  torque {axis.torque:.3f} V  stop code {axis.stop_code}"
    )
    return "  ".join((numbers, *(name for name, holds in facts.items() if holds)))
