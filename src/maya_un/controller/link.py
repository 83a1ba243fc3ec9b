"""The link to the controller: opened, watched, opened again after a loss, and never used to send motion by itself."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from dmc41x3.driver import Driver
from dmc41x3.wire.transport import Transport
from maya_un.controller.registers import identify
from maya_un.errors import MachineError, MayaError, NotConnected

Dial = Callable[[], Awaitable[Transport]]
"""Opens a transport to the controller; raises `ConnectFailed`."""

RETRY = (0.5, 1.0, 2.0, 5.0)
"""Waits between attempts to reach a lost controller [s]; the last one repeats."""


class DriverLink:
    """One driver at a time; `firmware` is what the device last said it is.

    `on_lost` is told the reason of a loss once, `on_back` when the controller answers again.
    """

    def __init__(
        self,
        dial: Dial,
        address: str,
        timeout: float,
        on_lost: Callable[[MachineError], None],
        on_back: Callable[[Driver], Awaitable[None]],
    ) -> None:
        self._dial = dial
        self.address = address
        self.firmware = ""
        self._timeout = timeout
        self._on_lost = on_lost
        self._on_back = on_back
        self._driver: Driver | None = None
        self._keeper: asyncio.Task[None] | None = None
        self._tap: Callable[[str, bytes], None] | None = None

    def tap(self, listener: Callable[[str, bytes], None]) -> None:
        """Hand every byte on the wire to `listener` ("tx" or "rx"), of this connection and of later ones."""
        self._tap = listener
        if self._driver is not None:
            self._driver.tap = listener

    @property
    def up(self) -> bool:
        """Whether there is a driver whose link has not been lost."""
        return self._driver is not None and not self._driver.lost.done()

    @property
    def driver(self) -> Driver:
        """The driver; raises `NotConnected` while there is none."""
        if self._driver is None or self._driver.lost.done():
            raise NotConnected
        return self._driver

    async def open(self) -> Driver:
        """Connect, make sure it is a DMC-41x3, and keep the link from now on.

        Raises `ConnectFailed`, `LinkTimeout`, `WrongController`.
        """
        self._driver = await self._connect()
        self._keeper = asyncio.get_running_loop().create_task(self._keep(), name="keep link")
        return self._driver

    async def close(self) -> None:
        """End the link and give the handle back."""
        if self._keeper is not None:
            self._keeper.cancel()
            await asyncio.gather(self._keeper, return_exceptions=True)
            self._keeper = None
        if self._driver is not None:
            await self._driver.close()
            self._driver = None

    async def _connect(self) -> Driver:
        transport = await self._dial()
        driver = await Driver.open(transport, timeout=self._timeout)
        driver.tap = self._tap
        try:
            self.firmware = await identify(driver, self.address)
        except BaseException:
            await driver.close()
            raise
        return driver

    async def _keep(self) -> None:
        while True:
            assert self._driver is not None
            reason = await asyncio.shield(self._driver.lost)
            await self._driver.close()
            self._on_lost(reason)
            self._driver = await self._again()
            await self._on_back(self._driver)

    async def _again(self) -> Driver:
        attempt = 0
        while True:
            await asyncio.sleep(RETRY[min(attempt, len(RETRY) - 1)])
            attempt += 1
            try:
                return await self._connect()
            except MayaError:
                continue
