from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest

from dmc41x3.driver import Driver
from dmc41x3.language.record import AxisRecord
from dmc41x3.wire.transport import LoopbackTransport, Transport, loopback_pair
from maya_un.config import Config
from maya_un.controller.monitor import Monitor
from maya_un.controller.registers import DriverLink
from maya_un.errors import ConnectFailed, LinkLost, LinkTimeout, MachineError, NotConnected, Stopped, WrongController
from maya_un.testing import faults
from tests.unit.controller.bench import FAR, FIRMWARE, homed, now, record_of
from tests.unit.dmc41x3.scripted import Peer
from tests.virtual_time import elapse

Answer = Callable[[str], bytes | None]


def well(command: str) -> bytes | None:
    if command == "QR":
        return record_of(AxisRecord(), AxisRecord(), AxisRecord()).encode() + b":"
    return f"{FIRMWARE}\r\n:".encode() if command == "\x12\x16" else b":"


def alien(command: str) -> bytes | None:
    return b"DMC2133 Rev 1.0r\r\n:" if command == "\x12\x16" else b":"


def silent(command: str) -> bytes | None:
    return None


class Wall:
    """Scripted controllers: each connection takes the next of `answers` and keeps the last; None refuses."""

    def __init__(self, *answers: Answer | None) -> None:
        self.answers: list[Answer | None] = list(answers)
        self.dialled: list[float] = []
        self.peers: list[Peer] = []
        self.tasks: list[asyncio.Task[None]] = []

    async def dial(self) -> Transport:
        self.dialled.append(now())
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if answer is None:
            raise ConnectFailed(address="box", reason="refused")
        ours, theirs = loopback_pair("box")
        self.peers.append(Peer(theirs, answer))
        self.tasks.append(asyncio.create_task(self.peers[-1].run()))
        return ours

    @property
    def end(self) -> LoopbackTransport:
        return self.peers[-1].end


class Ears:
    """Notes what a link tells."""

    def __init__(self) -> None:
        self.lost: list[tuple[float, MachineError]] = []
        self.back: list[float] = []

    def on_lost(self, reason: MachineError) -> None:
        self.lost.append((now(), reason))

    async def on_back(self, _: Driver) -> None:
        self.back.append(now())


@asynccontextmanager
async def linked(wall: Wall) -> AsyncIterator[tuple[DriverLink, Ears]]:
    ears = Ears()
    link = DriverLink(wall.dial, "box", 2.0, ears.on_lost, ears.on_back)
    try:
        yield link, ears
    finally:
        await link.close()
        await asyncio.gather(*wall.tasks)


async def test_open_reads_the_identity_of_the_controller() -> None:
    async with linked(Wall(well)) as (link, _):
        with pytest.raises(NotConnected):
            _ = link.driver
        assert not link.up
        assert await link.open() is link.driver
        assert (link.up, link.firmware) == (True, FIRMWARE)


@pytest.mark.parametrize(("answer", "error"), [(None, ConnectFailed), (alien, WrongController), (silent, LinkTimeout)])
async def test_failed_open_gives_its_reason_and_does_not_retry(
    answer: Answer | None, error: type[MachineError]
) -> None:
    wall = Wall(answer)
    async with linked(wall) as (link, ears):
        with pytest.raises(error):
            await link.open()
        await elapse(60.0)
        assert not link.up
    assert len(wall.dialled) == 1
    assert ears.lost == []


async def test_waits_grow_until_the_controller_answers() -> None:
    wall = Wall(well, None, None, None, None, None, well)
    async with linked(wall) as (link, ears):
        await link.open()
        await elapse(10.0)
        wall.end.cut()
        await elapse(30.0)
        assert link.up
    assert wall.dialled[1:] == [10.5, 11.5, 13.5, 18.5, 23.5, 28.5]
    assert [at for at, _ in ears.lost] == [10.0]
    assert ears.back == [28.5]


async def test_waits_start_over_after_every_loss() -> None:
    wall = Wall(well, None, well, None, well)
    async with linked(wall) as (link, ears):
        await link.open()
        for _ in range(2):
            wall.end.cut()
            await elapse(10.0)
    assert wall.dialled == [0.0, 0.5, 1.5, 10.5, 11.5]
    assert len(ears.lost) == len(ears.back) == 2


@pytest.mark.parametrize("answer", [alien, silent])
async def test_other_device_at_the_address_is_left_alone(answer: Answer) -> None:
    wall = Wall(well, answer, well)
    async with linked(wall) as (link, ears):
        await link.open()
        wall.end.cut()
        await elapse(20.0)
        assert link.firmware == FIRMWARE
    assert wall.peers[1].commands == ["\x12\x16"]
    assert len(ears.back) == 1


async def test_loss_is_reported_once_and_calls_fail_meanwhile() -> None:
    wall = Wall(well, None)
    async with linked(wall) as (link, ears):
        driver = await link.open()
        wall.end.cut()
        await elapse(100.0)
        assert [type(reason) for _, reason in ears.lost] == [LinkLost]
        assert driver.lost.done()
        with pytest.raises(NotConnected):
            _ = link.driver


async def test_silence_is_a_loss_too() -> None:
    wall = Wall(lambda command: None if command == "QR" else well(command), None)
    async with linked(wall) as (link, ears):
        driver = await link.open()
        with pytest.raises(LinkTimeout):
            await driver.record()
        await elapse(0.1)
        assert [(at, type(reason)) for at, reason in ears.lost] == [(2.0, LinkTimeout)]


async def test_closing_ends_the_dialling() -> None:
    wall = Wall(well, None)
    async with linked(wall) as (link, _):
        await link.open()
        wall.end.cut()
        await elapse(4.0)
    count = len(wall.dialled)
    await elapse(60.0)
    assert len(wall.dialled) == count


async def test_a_controller_that_hangs_up_behind_its_name_is_dialled_again() -> None:
    wall = Wall(well)
    monitor = Monitor(wall.dial, "box", Config())
    await monitor.link.open()

    def hang_up(command: str) -> bytes | None:
        wall.end.write(well(command) or b"")
        wall.end._end(keep=True)
        return None

    wall.answers[:] = [hang_up, well]
    wall.end.cut()
    await elapse(10.0)
    assert len(wall.dialled) == 3
    assert monitor.link.up
    await monitor.close()
    await asyncio.gather(*wall.tasks)


async def test_link_is_closed_although_the_stop_before_failed() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        with faults.half_open(bench.virtual), pytest.raises(MachineError):
            await bench.controller.close()
        assert bench.controller._monitor.link._driver is None
        assert bench.controller._monitor.link._keeper is None
        await asyncio.wait({move})
        assert isinstance(move.exception(), Stopped)
