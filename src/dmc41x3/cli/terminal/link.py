"""The link of a terminal: made, lost, made again; and where the messages of programs went before it came."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from dmc41x3.cli.dial import Dial
from dmc41x3.cli.send import TIMEOUT
from dmc41x3.driver import Driver
from dmc41x3.errors import CodedError, CommandRejected, MachineError, NotConnected

_SERIAL = ord("S")
"""CF as a controller powers up: messages go to its serial port, so nobody on the network misses them."""


class TerminalLink:
    """One controller, reached again and again through `dial`."""

    def __init__(self, dial: Dial, on_message: Callable[[str], None], on_loss: Callable[[MachineError], None]) -> None:
        self._dial = dial
        self._on_message = on_message
        self._on_loss = on_loss
        self._driver: Driver | None = None
        self._marked = 2.0
        self._one_at_a_time = asyncio.Lock()
        self.messages = False

    @property
    def driver(self) -> Driver:
        """The driver of a link that stands; raises `NotConnected` where none does."""
        if self._driver is None or self._driver.lost.done():
            raise NotConnected
        return self._driver

    @property
    def up(self) -> bool:
        """Whether the link stands."""
        return self._driver is not None and not self._driver.lost.done()

    async def connect(self) -> None:
        """Make the link anew, and take the programs' messages where nobody else has them; raises `ConnectFailed`."""
        async with self._one_at_a_time:
            await self._connect()

    async def _connect(self) -> None:
        await self.close()
        driver = await Driver.open(await self._dial(), timeout=TIMEOUT)
        driver.on_message = self._on_message
        driver.lost.add_done_callback(self._lost)
        self._driver = driver
        try:
            if await _number(driver, "_CF", _SERIAL) == _SERIAL:
                await self.take_messages()
        except MachineError:
            await self.close()
            raise

    async def take_messages(self) -> None:
        """Have the messages of programs come here (CF I, CW 1), whoever had them."""
        self._marked = await _number(self.driver, "_CW", 2)
        await self.driver.subscribe()
        self.messages = True

    async def close(self) -> None:
        """Give back what was taken and end the link; again is harmless."""
        driver, self._driver = self._driver, None
        if driver is None:
            return
        if self.messages and not driver.lost.done():
            await self._give_back(driver)
        self.messages = False
        await driver.close()

    async def _give_back(self, driver: Driver) -> None:
        try:
            await driver.batch(["CF S", f"CW {self._marked:.0f}"])
        except CodedError:
            return  # the controller gives it back itself when the handle closes

    def _lost(self, lost: asyncio.Future[MachineError]) -> None:
        if not lost.cancelled():
            self._on_loss(lost.result())


async def _number(driver: Driver, operand: str, default: float) -> float:
    try:
        return await driver.value(operand)
    except CommandRejected:
        return default
