"""Connect the tools to a controller: a twin, the configured one, or one by its address; `dmc send`."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Iterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import asdict
from typing import TypeVar

from dmc41x3.address import SIM, ControllerAddress, parse
from dmc41x3.cli import console
from dmc41x3.cli.console import OutputSettings, Site, controller_address
from dmc41x3.cli.signals import on_end
from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import AxisRecord, DataRecord
from dmc41x3.wire.framing import LineSplitter
from dmc41x3.wire.transport import Transport, connect

TIMEOUT = 5.0
"""Longest wait for a reply of a controller [s]."""


def send(address: str, commands: Sequence[str], settings: OutputSettings) -> int:
    """Send commands in order and print their replies; stop at the first rejection.

    An element of `commands` may hold several commands separated by `;`.

    Raises `ConnectFailed`, `LinkTimeout`, and `CommandRejected` with the controller's own code.
    """
    place = controller_address(settings.site.meant(address, settings.config), "HOST")
    replies = asyncio.run(_converse(place, commands, settings))
    if settings.json:
        console.emit({"address": str(place), "replies": replies})
    return console.DONE


async def _converse(
    place: ControllerAddress, commands: Sequence[str], settings: OutputSettings
) -> list[dict[str, object]]:
    driver = await Driver.open(await connect(place, TIMEOUT), timeout=TIMEOUT)
    replies: list[dict[str, object]] = []
    try:
        for command in _single(commands):
            reply = await _reply(driver, command)
            record = isinstance(reply, DataRecord)
            replies.append({"command": command, "reply": asdict(reply) if record else reply})
            if not settings.json:
                console.say(_record_text(reply) if record else reply or ":")
    finally:
        await driver.close()
    return replies


def _single(commands: Sequence[str]) -> Iterator[str]:
    """Yield single commands; `;` separates commands as on the wire (`SH;TP`)."""
    for command in commands:
        if not command.isascii() or ";" not in command:
            yield command
        else:
            splitter = LineSplitter()
            splitter.limit = len(command)  # each goes in a line of its own
            yield from filter(None, splitter.feed(f"{command}\r".encode("ascii")))


async def _reply(driver: Driver, command: str) -> str | DataRecord:
    """Return a reply as text; QR answers with a record."""
    return await driver.record() if command.strip().upper() == "QR" else await driver.send(command)


def _record_text(record: DataRecord) -> str:
    """Return a record as text: one line for each axis, in the controller's units."""
    return "\n".join(_axis_text(letter, axis) for letter, axis in zip(LETTERS, record.axes, strict=False))


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


T = TypeVar("T")

Dial = Callable[[], Awaitable[Transport]]
"""Opens one more connection to the same controller; raises `ConnectFailed`."""


def meant(address: str, settings: OutputSettings) -> str:
    """Return the address that an argument means: `sim`, HOST, HOST:PORT or a serial port; raises `InvalidValue`."""
    place = settings.site.meant(address, settings.config)
    if address != SIM:
        controller_address(place, words=phrase("sim or real"))
    return place


@asynccontextmanager
async def reached(address: str, site: Site) -> AsyncIterator[Dial]:
    """Yield a function that connects to the controller at `address`; for `sim` the twin exists during the block."""
    if address != SIM:
        yield lambda: connect(parse(address), TIMEOUT)
        return
    twin = site.twin()

    async def loopback() -> Transport:
        return twin.loopback()

    try:
        yield loopback
    finally:
        await twin.close()


@asynccontextmanager
async def opened(address: str, site: Site) -> AsyncIterator[Driver]:
    """Yield a driver for the controller at `address`; raises `ConnectFailed`."""
    async with reached(address, site) as dial:
        driver = await Driver.open(await dial(), timeout=TIMEOUT)
        try:
            yield driver
        finally:
            await driver.close()


async def until_asked(work: Coroutine[None, None, T]) -> T | None:
    """Return the result of `work`, or None if Ctrl-C or SIGTERM ends it first."""
    task = asyncio.create_task(work)
    with on_end(task.cancel, signal.SIGINT, signal.SIGTERM):
        await asyncio.wait({task})
    return None if task.cancelled() else task.result()
