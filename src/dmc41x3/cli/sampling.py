"""Taking channels again and again: from one record where it holds them, the others by MG."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator, Sequence
from typing import NamedTuple

from dmc41x3.driver import Driver
from dmc41x3.errors import CommandRejected, UnexpectedReply
from dmc41x3.language.channels import Reading, SampleClock, reading
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.hardware import SAMPLES
from dmc41x3.language.numbers import parse_number

_TIME = "TIME"


class ChannelSample(NamedTuple):
    """Values of all channels; `time` is the controller's own [s], 0 at the first sample."""

    time: float
    values: tuple[float, ...]


class Sampler:
    """Takes samples of fixed channels; made by `prepare`."""

    def __init__(self, driver: Driver, channels: Sequence[str], axes: int, period: float) -> None:
        self._driver = driver
        self.channels = tuple(channels)
        self._readings: dict[str, Reading] = {}
        for channel in channels:
            if (read := reading(channel, axes)) is not None:
                self._readings[channel] = read
        asked = [channel for channel in self.channels if channel not in self._readings]
        self._asked = asked if self._readings else [_TIME, *asked]
        self._clock = SampleClock(period)
        self._second = SAMPLES * 1000.0 / period
        self._first: float | None = None

    @classmethod
    async def prepare(cls, driver: Driver, channels: Sequence[str]) -> Sampler:
        """Return a sampler whose every channel has answered once; raises `CommandRejected` for one that does not."""
        axes = len((await driver.record()).axes)
        sampler = cls(driver, channels, axes, await _period(driver))
        for channel in sampler._asked:
            await driver.value(channel)
        return sampler

    async def sample(self) -> ChannelSample:
        """Return the values of now; raises as the driver does."""
        if not self._readings:
            found = await self._ask()
            return ChannelSample(self._since_first(found[_TIME]), tuple(found[name] for name in self.channels))
        record, found = await asyncio.gather(self._driver.record(), self._ask())
        found.update({name: read(record) for name, read in self._readings.items()})
        return ChannelSample(self._clock.at(record.sample), tuple(found[name] for name in self.channels))

    async def _ask(self) -> dict[str, float]:
        found: dict[str, float] = {}
        for group in _lines(self._asked):
            command = f"MG {','.join(group)}"
            reply = await self._driver.send(command)
            try:
                numbers = [parse_number(word) for word in reply.split()]
                found.update(zip(group, numbers, strict=True))
            except ValueError as error:
                raise UnexpectedReply(command=command, reply=reply) from error
        return found

    def _since_first(self, time: float) -> float:
        if self._first is None:
            self._first = time
        return (time - self._first) / self._second


async def _period(driver: Driver) -> float:
    """Return TM [µs], its default where the controller does not tell."""
    try:
        return await driver.value("_TM") or 1000.0
    except CommandRejected:
        return 1000.0


def _lines(channels: Sequence[str]) -> Iterator[list[str]]:
    """Yield the channels in groups that one line of the controller holds."""
    group: list[str] = []
    for channel in channels:
        if group and len(f"MG {','.join([*group, channel])}") > LINE_LIMIT:
            yield group
            group = []
        group.append(channel)
    if group:
        yield group


async def samples(sampler: Sampler, rate: float, seconds: float | None) -> AsyncIterator[ChannelSample]:
    """Yield `rate` samples a second for so long, without an end for None; what comes too late is left out."""
    async for _ in ticks(rate, seconds):
        yield await sampler.sample()


async def ticks(rate: float, seconds: float | None) -> AsyncIterator[int]:
    """Yield `rate` numbers a second, from 0, at once and then on time; those that come too late are left out."""
    loop = asyncio.get_running_loop()
    start = loop.time()
    tick = 0
    while seconds is None or tick <= seconds * rate + 1e-9:
        await asyncio.sleep(max(0.0, start + tick / rate - loop.time()))
        yield tick
        tick = max(tick + 1, int((loop.time() - start) * rate))
