"""Streams of data records: sent by UDP at the controller's own pace (DR), or polled (QR).

The controller has one such stream. A DR of another client takes it over; this stream then falls silent, and records
are polled from then on.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import suppress
from enum import Enum
from typing import Protocol

from dmc41x3.errors import CodedError, CommandRejected, ConnectFailed, InvalidValue, LinkLost, MachineError
from dmc41x3.i18n import phrase
from dmc41x3.language.hardware import LONGEST_PERIOD, SAMPLES, SHORTEST_PERIOD
from dmc41x3.language.record import DataRecord, decode
from dmc41x3.wire.transport import DatagramFactory, Datagrams

SILENCE = 1.0
"""Time without a record, at least 20 periods, after which the stream checks the controller [s]."""

_ANSWER = 0.25
_ATTEMPTS = 3
_WRAP = 1 << 16
_HEAD = 6
"""Bytes of a record up to its sample number."""

_LETTER = re.compile(rb"IH([A-H])\r\n:")


class StreamMode(Enum):
    """How the records arrive."""

    SENT = "DR by UDP"
    POLLED = "QR by TCP"


class RawRecord:
    """A data record as received; its content is decoded at the first access, and once."""

    __slots__ = ("_decoded", "data")

    def __init__(self, data: bytes) -> None:
        self.data = data
        self._decoded: DataRecord | None = None

    @property
    def sample(self) -> int:
        """The low 16 bits of TIME."""
        return int.from_bytes(self.data[4:6], "little")

    @property
    def record(self) -> DataRecord:
        """Its content; raises `UnexpectedReply` if it is not a whole record."""
        if self._decoded is None:
            self._decoded = decode(self.data)
        return self._decoded


class Gaps:
    """Finds missing records of a stream by their sample numbers; `period` is in samples."""

    def __init__(self, period: int) -> None:
        self._period = period
        self._last: int | None = None
        self.lost = 0

    def take(self, sample: int) -> bool:
        """Register the next record; return whether it is newer than all before it."""
        if self._last is None:
            self._last = sample
            return True
        ahead = (sample - self._last) % _WRAP
        if not 0 < ahead < _WRAP // 2:
            return False
        self._last = sample
        self.lost += max(0, round(ahead / self._period) - 1)
        return True


class StreamLink(Protocol):
    """The part of the driver's link that a stream needs."""

    @property
    def lost(self) -> asyncio.Future[MachineError]:
        """The reason for the loss of the link, once it is lost."""
        ...

    async def send(self, command: str) -> str:
        """Send one command and return its output."""
        ...

    async def value(self, operand: str) -> float:
        """Return the value of an operand."""
        ...

    async def raw_record(self) -> bytes:
        """Return the present record."""
        ...


def period_of(rate: float) -> int:
    """Return the period of DR [samples] nearest to `rate` [1/s]; raises `InvalidValue` if that is not offered."""
    period = round(SAMPLES / rate / 2.0) * 2 if rate > 0.0 else 0
    if not SHORTEST_PERIOD <= period <= LONGEST_PERIOD:
        slowest, fastest = SAMPLES / LONGEST_PERIOD, SAMPLES / SHORTEST_PERIOD
        raise InvalidValue(
            key="rate",
            value=f"{rate:g}",
            reason=phrase("it must be {least:.3f} to {most:g} per second", least=slowest, most=fastest),
        )
    return period


class RecordStream:
    """A stream of records; created by `Driver.stream`, ended by `close`.

    `latest` is the newest record; iterating yields it and every newer one, and a slow reader skips to the newest. If
    the link is lost, iterating raises that loss. If the driver was closed before the stream, it raises
    `NotConnected`; after `close` it ends. `way` is how records arrive and `reason` why they are polled; a stream that
    fell back to polling continues to poll. `lost` counts the records that were sent and did not arrive, `received`
    those that did.
    """

    def __init__(self, link: StreamLink, period: int) -> None:
        self._link = link
        self._loop = asyncio.get_running_loop()
        self._gaps = Gaps(period)
        self._seconds = period / SAMPLES
        self._silence = max(SILENCE, 20 * self._seconds)
        self._endpoint: Datagrams | None = None
        self._place: int | None = None
        self._task: asyncio.Task[None] | None = None
        self._waiters: list[asyncio.Future[None]] = []
        self._error: CodedError | None = None
        self._ended = False
        self.latest: RawRecord | None = None
        self.received = 0
        self.way = StreamMode.POLLED
        self.reason = ""

    @classmethod
    async def open(cls, link: StreamLink, rate: float, datagrams: DatagramFactory | None) -> RecordStream:
        """Open a stream; see `Driver.stream`."""
        stream = cls(link, period := period_of(rate))
        try:
            stream.reason = await stream._begin(datagrams, period)
        except BaseException:
            await stream._give_back()
            raise
        if stream.reason:
            await stream._give_back()
        else:
            stream.way = StreamMode.SENT
        stream._task = stream._loop.create_task(stream._run(), name="data records")
        return stream

    @property
    def lost(self) -> int:
        """Number of records that were sent and did not arrive."""
        return self._gaps.lost

    @property
    def rate(self) -> float:
        """Records in a second, rounded to the controller's samples."""
        return 1.0 / self._seconds

    async def __aiter__(self) -> AsyncIterator[RawRecord]:
        seen = 0
        while True:
            while self.received == seen and not self._ended:
                await self._next()
            if self.received == seen or self.latest is None:
                break
            seen = self.received
            yield self.latest
        if self._error is not None:
            raise self._error.copy()

    async def _next(self) -> None:
        waiter = self._loop.create_future()
        self._waiters.append(waiter)
        await waiter

    async def close(self) -> None:
        """End the stream on both sides; idempotent."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait({self._task})
            self._task = None
            await self._give_back()
        self._end(None)

    async def _begin(self, datagrams: DatagramFactory | None, period: int) -> str:
        """Request records by UDP; return why that is impossible, or an empty text."""
        if datagrams is None:
            return "no way for UDP was given"
        try:
            self._endpoint = await datagrams()
        except ConnectFailed as error:
            return str(error.details["reason"])
        try:
            self._place = await self._learn_handle(self._endpoint)
            if self._place is None:
                return "the controller does not answer by UDP"
            await self._link.send(f"DR {period},{self._place}")
        except CommandRejected as error:
            return f"DR was refused: {error.details['reason']}"
        except LinkLost as error:
            if self._link.lost.done():
                raise
            return str(error.details["reason"])
        return ""

    async def _learn_handle(self, endpoint: Datagrams) -> int | None:
        """Return the number of the handle that the controller gave to this socket, None if it does not answer."""
        for _ in range(_ATTEMPTS):
            endpoint.write(b"WH\r")
            with suppress(TimeoutError):
                async with asyncio.timeout(_ANSWER):
                    found = _LETTER.search(await endpoint.read())
                    if found is not None:
                        return found[1][0] - ord("A")
        return None

    async def _run(self) -> None:
        try:
            if self.way is StreamMode.SENT and self._endpoint is not None:
                self.reason = await self._receive(self._endpoint)
                self.way = StreamMode.POLLED
                await self._give_back()
            await self._poll()
        except CodedError as error:
            self._end(error)

    async def _receive(self, endpoint: Datagrams) -> str:
        """Receive records until they stop; return why. Raises the loss of the link."""
        reader = self._loop.create_task(self._read(endpoint))
        try:
            while True:
                before = self.received
                await asyncio.wait({reader, self._link.lost}, timeout=self._silence, return_when="FIRST_COMPLETED")
                if self._link.lost.done():
                    raise self._link.lost.result()
                if reader.done():
                    return reader.result()
                if self.received == before and not await self._only_busy(before, reader):
                    return f"no record came for {2.0 * self._silence:g} s"
        finally:
            reader.cancel()

    async def _only_busy(self, before: int, reader: asyncio.Task[str]) -> bool:
        """Return whether records arrive again once the controller has time to answer (BN, DL and others pause DR)."""
        await self._link.raw_record()
        await asyncio.wait({reader, self._link.lost}, timeout=self._silence, return_when="FIRST_COMPLETED")
        return self.received != before or reader.done() or self._link.lost.done()

    async def _read(self, endpoint: Datagrams) -> str:
        """Receive datagrams by a callback, which saves a task switch for each; return why they ended."""
        endpoint.deliver(self._arrived)
        try:
            while await endpoint.read():
                pass
        except LinkLost as error:
            return str(error.details["reason"])
        return "the way for UDP was closed"

    def _arrived(self, data: bytes) -> None:
        if len(data) <= _HEAD or not data[0] & 0x80 or len(data) != int.from_bytes(data[2:4], "little"):
            return
        if self.way is StreamMode.SENT:
            record = RawRecord(data)
            if self._gaps.take(record.sample):
                self._take(record)

    async def _poll(self) -> None:
        due = self._loop.time()
        while True:
            self._take(RawRecord(await self._link.raw_record()))
            due = max(due + self._seconds, self._loop.time())
            await asyncio.sleep(due - self._loop.time())

    def _take(self, record: RawRecord) -> None:
        self.latest = record
        self.received += 1
        self._wake()

    def _wake(self) -> None:
        waiters, self._waiters = self._waiters, []
        for waiter in waiters:
            if not waiter.done():
                waiter.set_result(None)

    def _end(self, error: CodedError | None) -> None:
        if not self._ended:
            self._ended, self._error = True, error
            self._wake()

    async def _give_back(self) -> None:
        """Stop the records and free the handle, which would otherwise stay in use for ever."""
        endpoint, self._endpoint = self._endpoint, None
        place, self._place = self._place, None
        if endpoint is None:
            return
        with suppress(CodedError):
            if place is None or self._link.lost.done():
                endpoint.write(b"DR 0;IHS=>-1\r" if place is not None else b"IHS=>-1\r")
            else:
                if await self._link.value("_DR1") == place:
                    await self._link.send("DR 0")
                await self._link.send(f"IH{chr(ord('A') + place)}=>-1")
        await endpoint.close()
