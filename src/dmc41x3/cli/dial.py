"""How the tools reach a controller: a twin of their own, the configured one, or one by its address."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import TypeVar

from dmc41x3.address import REAL, SIM, split
from dmc41x3.cli.send import TIMEOUT
from dmc41x3.cli.settings import OutputSettings
from dmc41x3.cli.signals import on_end
from dmc41x3.cli.site import Site
from dmc41x3.cli.values import host_and_port
from dmc41x3.driver import Driver
from dmc41x3.wire.transport import TcpTransport, Transport

T = TypeVar("T")

Dial = Callable[[], Awaitable[Transport]]
"""Makes one more connection to the same controller; raises `ConnectFailed`."""


def meant(address: str, settings: OutputSettings) -> str:
    """Return what an address on the command line means: `sim`, HOST or HOST:PORT; raises `InvalidValue`."""
    place = settings.site.meant(address, settings.config)
    if address != SIM:
        host_and_port(place, words=f"{SIM} or {REAL}")
    return place


@asynccontextmanager
async def reached(address: str, site: Site) -> AsyncIterator[Dial]:
    """Give the way to the controller at `address` while the block runs; for `sim` that is how long the twin lives."""
    if address != SIM:
        host, port = split(address)
        yield lambda: TcpTransport.connect(host, port, TIMEOUT)
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
    """Give a driver on the controller at `address` while the block runs; raises `ConnectFailed`."""
    async with reached(address, site) as dial:
        driver = await Driver.open(await dial(), timeout=TIMEOUT)
        try:
            yield driver
        finally:
            await driver.close()


async def until_asked(work: Coroutine[None, None, T]) -> T | None:
    """Return what `work` returns, None where Ctrl-C or SIGTERM ends it before."""
    task = asyncio.create_task(work)
    with on_end(task.cancel, signal.SIGINT, signal.SIGTERM):
        await asyncio.wait({task})
    return None if task.cancelled() else task.result()
