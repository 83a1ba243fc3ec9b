"""How the tools reach a controller: a twin of their own, the configured one, or one by its address."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import TypeVar

from dmc41x3.driver import Driver
from dmc41x3.wire.transport import TcpTransport, Transport
from maya_un.address import SIM, split
from maya_un.assembly import make_twin
from maya_un.cli.configure import configuration
from maya_un.cli.dmc import TIMEOUT
from maya_un.cli.quantities import target_address
from maya_un.cli.settings import OutputSettings
from maya_un.cli.signals import on_end
from maya_un.controller.ownership import living_owner
from maya_un.errors import ControllerOwned

T = TypeVar("T")

Dial = Callable[[], Awaitable[Transport]]
"""Makes one more connection to the same controller; raises `ConnectFailed`."""


def meant(address: str, settings: OutputSettings) -> str:
    """Return what an address on the command line means: `sim`, HOST or HOST:PORT; raises `InvalidValue`."""
    return target_address(address, configuration(settings).controller.address)


@asynccontextmanager
async def reached(address: str) -> AsyncIterator[Dial]:
    """Give the way to the controller at `address` while the block runs; for `sim` that is how long the twin lives."""
    if address != SIM:
        host, port = split(address)
        yield lambda: TcpTransport.connect(host, port, TIMEOUT)
        return
    twin = make_twin()

    async def loopback() -> Transport:
        return twin.controller.loopback()

    try:
        yield loopback
    finally:
        await twin.controller.close()


@asynccontextmanager
async def opened(address: str) -> AsyncIterator[Driver]:
    """Give a driver on the controller at `address` while the block runs; raises `ConnectFailed`."""
    async with reached(address) as dial:
        driver = await Driver.open(await dial(), timeout=TIMEOUT)
        try:
            yield driver
        finally:
            await driver.close()


async def require_free(driver: Driver, address: str) -> None:
    """Raise `ControllerOwned` where the controller belongs to a program that lives."""
    holder = await living_owner(driver)
    if holder:
        raise ControllerOwned(address=address, holder=holder)


async def until_asked(work: Coroutine[None, None, T]) -> T | None:
    """Return what `work` returns, None where Ctrl-C or SIGTERM ends it before."""
    task = asyncio.create_task(work)
    with on_end(task.cancel, signal.SIGINT, signal.SIGTERM):
        await asyncio.wait({task})
    return None if task.cancelled() else task.result()
