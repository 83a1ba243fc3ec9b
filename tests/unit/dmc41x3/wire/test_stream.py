"""Records that come by themselves: counted, taken, missed, and polled where they do not come."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import pairwise

import pytest

from dmc41x3.driver import Driver
from dmc41x3.errors import ConnectFailed, InvalidValue, LinkLost, NotConnected, UnexpectedReply
from dmc41x3.language.record import AxisRecord, DataRecord, encode
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.network import HandleProtocol
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.stream import Gaps, RawRecord, RecordStream, StreamMode, period_of
from dmc41x3.wire.transport import Datagrams, LoopbackDatagrams, TcpTransport, UdpTransport
from tests.served_twin import ServedTwin, served
from tests.virtual_time import elapse

RECORD = DataRecord(axes=(AxisRecord(position=12), AxisRecord(), AxisRecord()), sample=40_000)


class Lab:
    """A twin, a driver of it, and ways for datagrams to it, the last of which is `endpoint`."""

    def __init__(self, controller: VirtualController, driver: Driver) -> None:
        self.controller = controller
        self.driver = driver
        self.endpoint: LoopbackDatagrams | None = None

    async def datagrams(self) -> Datagrams:
        self.endpoint = self.controller.loopback_datagrams()
        return self.endpoint

    @property
    def handles(self) -> int:
        """Number of handles in use."""
        return 8 - self.controller.machine.unit.handles.free


@asynccontextmanager
async def lab() -> AsyncIterator[Lab]:
    controller = VirtualController(VirtualDmc(BenchPlant()))
    driver = await Driver.open(controller.loopback(), timeout=2.0)
    try:
        yield Lab(controller, driver)
    finally:
        await driver.close()
        await controller.close()


@asynccontextmanager
async def streaming(laboratory: Lab, rate: float = 51.2) -> AsyncIterator[RecordStream]:
    stream = await laboratory.driver.stream(rate, laboratory.datagrams)
    try:
        yield stream
    finally:
        await stream.close()


@pytest.mark.parametrize(("rate", "period"), [(51.2, 20), (50.0, 20), (128.0, 8), (1.0, 1024), (0.0342, 29942)])
def test_the_period_nearest_to_a_rate(rate: float, period: int) -> None:
    assert period_of(rate) == period


@pytest.mark.parametrize("rate", [0.0, -1.0, 200.0, 0.03])
def test_a_rate_that_is_not_offered_is_refused(rate: float) -> None:
    with pytest.raises(InvalidValue, match="per second"):
        period_of(rate)


@pytest.mark.parametrize(
    ("samples", "lost"),
    [
        ([0, 20, 40, 60], 0),
        ([0, 20, 60, 80], 1),
        ([0, 100], 4),
        ([65_500, 65_520, 4, 24], 0),
        ([65_500, 24], 2),
        ([0, 21, 39, 60], 0),
    ],
)
def test_gaps_are_seen_in_the_sample_numbers(samples: list[int], lost: int) -> None:
    gaps = Gaps(20)
    assert all(gaps.take(sample) for sample in samples)
    assert gaps.lost == lost


def test_overtaken_or_repeated_record_is_ignored() -> None:
    gaps = Gaps(20)
    assert [gaps.take(sample) for sample in (0, 40, 20, 40, 60)] == [True, True, False, False, True]


def test_record_is_decoded_on_access_and_once() -> None:
    raw = RawRecord(encode(RECORD))
    assert raw.sample == 40_000
    assert raw.record == RECORD
    assert raw.record is raw.record
    damaged = RawRecord(encode(RECORD)[:-1])
    with pytest.raises(UnexpectedReply):
        assert damaged.record


async def test_records_have_the_controllers_rate() -> None:
    async with lab() as laboratory, streaming(laboratory) as stream:
        assert stream.way is StreamMode.SENT
        await laboratory.driver.batch(["SH", "JGA=10240", "BGA"])
        samples: list[int] = []
        async for raw in stream:
            samples.append(raw.sample)
            if len(samples) == 50:
                assert raw.record.axes[0].moving
                break
        assert [after - before for before, after in pairwise(samples)] == [20] * 49
        assert (stream.lost, stream.reason, stream.rate) == (0, "", 51.2)
        assert laboratory.driver.lost.done() is False


async def test_a_slow_reader_skips_to_the_newest() -> None:
    async with lab() as laboratory, streaming(laboratory) as stream:
        seen: list[int] = []
        async for raw in stream:
            seen.append(raw.sample)
            if len(seen) == 3:
                break
            await elapse(1.0)
        assert [after - before for before, after in pairwise(seen)] == [1020, 1020]
        assert stream.latest is not None
        assert stream.latest.sample == seen[-1]
        assert stream.received > 100


async def test_several_readers_have_every_record() -> None:
    async with lab() as laboratory, streaming(laboratory) as stream:

        async def ten() -> list[int]:
            found: list[int] = []
            async for raw in stream:
                found.append(raw.sample)
                if len(found) == 10:
                    break
            return found

        first, second = await asyncio.gather(ten(), ten())
        assert first == second


async def test_both_handles_are_given_back_and_the_stream_ended() -> None:
    async with lab() as laboratory:
        async with streaming(laboratory) as stream:
            assert laboratory.handles == 2
        await stream.close()
        assert laboratory.handles == 1
        assert await laboratory.driver.value("_DR0") == 0.0
        assert [raw async for raw in stream] == []


async def test_lost_datagrams_are_counted() -> None:
    async with lab() as laboratory, streaming(laboratory) as stream:
        await elapse(0.5)
        assert laboratory.endpoint is not None
        theirs = laboratory.endpoint._other
        assert theirs is not None
        theirs.blocked = True
        await elapse(0.2)
        theirs.blocked = False
        await elapse(0.5)
        assert 9 <= stream.lost <= 11
        assert stream.way is StreamMode.SENT


async def test_silent_udp_falls_back_to_polling() -> None:
    async with lab() as laboratory, streaming(laboratory) as stream:
        await elapse(0.5)
        assert laboratory.endpoint is not None
        theirs = laboratory.endpoint._other
        assert theirs is not None
        theirs.blocked = True
        await elapse(3.0)
        assert stream.way is StreamMode.POLLED
        assert stream.reason == "no record came for 2 s"
        assert laboratory.handles == 1
        theirs.blocked = False
        before = stream.received
        await elapse(1.0)
        assert stream.received - before == pytest.approx(51, abs=1)
        assert stream.way is StreamMode.POLLED


async def test_pause_while_the_controller_burns_is_no_silence() -> None:
    async with lab() as laboratory, streaming(laboratory) as stream:
        await elapse(0.5)
        await laboratory.driver.send("BN")
        await elapse(1.9)
        paused = stream.received
        await elapse(2.0)
        assert stream.way is StreamMode.SENT
        assert stream.received - paused > 50


async def test_foreign_stream_is_left_alone() -> None:
    async with lab() as laboratory, streaming(laboratory) as stream:
        other = laboratory.controller.loopback_datagrams()
        other.write(b"WH\r")
        assert await other.read() == b"IHC\r\n:"
        await laboratory.driver.send("DR 100,2")
        await elapse(4.0)
        assert stream.way is StreamMode.POLLED
        assert await laboratory.driver.value("_DR0") == 100.0
        assert laboratory.handles == 2
        await other.close()


async def test_without_a_way_for_datagrams_records_are_polled() -> None:
    async with lab() as laboratory:
        stream = await laboratory.driver.stream(10.24)
        assert (stream.way, stream.reason) == (StreamMode.POLLED, "no way for UDP was given")
        await elapse(1.05)
        assert stream.received == 11
        await stream.close()


async def test_a_controller_that_does_not_answer_by_udp_is_polled() -> None:
    async with lab() as laboratory:

        async def deaf() -> Datagrams:
            way = await laboratory.datagrams()
            assert laboratory.endpoint is not None
            laboratory.endpoint.blocked = True
            return way

        stream = await laboratory.driver.stream(51.2, deaf)
        assert (stream.way, stream.reason) == (StreamMode.POLLED, "the controller does not answer by UDP")
        await stream.close()
        assert laboratory.handles == 1


async def test_an_answer_that_is_blocked_leaves_no_handle_taken() -> None:
    async with lab() as laboratory:

        async def mute() -> Datagrams:
            way = await laboratory.datagrams()
            assert laboratory.endpoint is not None
            theirs = laboratory.endpoint._other
            assert theirs is not None
            theirs.blocked = True
            return way

        stream = await laboratory.driver.stream(51.2, mute)
        await elapse(0.1)
        assert stream.way is StreamMode.POLLED
        assert laboratory.handles == 1
        await stream.close()


async def test_unavailable_transport_is_no_failure() -> None:
    async def none() -> Datagrams:
        raise ConnectFailed(address="box:23", reason="network is unreachable")

    async with lab() as laboratory:
        stream = await laboratory.driver.stream(51.2, none)
        assert (stream.way, stream.reason) == (StreamMode.POLLED, "network is unreachable")
        await stream.close()


async def test_without_a_free_handle_records_are_polled() -> None:
    async with lab() as laboratory:
        for _ in range(7):
            laboratory.controller.loopback()
        stream = await laboratory.driver.stream(51.2, laboratory.datagrams)
        assert stream.way is StreamMode.POLLED
        await stream.close()


@pytest.mark.parametrize("by_udp", [True, False])
async def test_a_lost_link_ends_the_stream_with_its_reason(by_udp: bool) -> None:
    async with lab() as laboratory:
        stream = await laboratory.driver.stream(51.2, laboratory.datagrams if by_udp else None)
        await elapse(0.5)
        laboratory.controller.cut()
        with pytest.raises(LinkLost):
            async for _ in stream:
                pass
        with pytest.raises(LinkLost):
            async for _ in stream:
                pass
        await stream.close()


async def test_driver_closed_before_its_stream_is_reported() -> None:
    async with lab() as laboratory:
        stream = await laboratory.driver.stream(51.2)
        await elapse(0.5)
        await laboratory.driver.close()
        with pytest.raises(NotConnected):
            async for _ in stream:
                pass
        await stream.close()


async def by_real_udp(twin: ServedTwin) -> tuple[list[int], StreamMode, str]:
    """Take ten records, or what comes in their place."""
    driver = await Driver.open(await TcpTransport.connect(twin.host, twin.port, 5.0), timeout=5.0)
    stream = await driver.stream(128.0, lambda: UdpTransport.connect(twin.host, twin.port))
    samples: list[int] = []
    async for raw in stream:
        samples.append(raw.sample)
        if len(samples) == 10:
            break
    await stream.close()
    await driver.close()
    return samples, stream.way, stream.reason


def test_records_arrive_by_a_real_socket() -> None:
    with served() as twin:
        samples, way, _ = asyncio.run(by_real_udp(twin))
        kinds = twin.look(lambda machine: [handle.kind for handle in machine.unit.handles if handle is not None])
    assert HandleProtocol.UDP not in kinds
    assert way is StreamMode.SENT
    assert all((after - before) % 8 == 0 for before, after in pairwise(samples))


def test_without_a_udp_listener_records_are_polled() -> None:
    with served(udp=False) as twin:
        samples, way, reason = asyncio.run(by_real_udp(twin))
    assert (way, reason) == (StreamMode.POLLED, "Connection refused")
    assert len(samples) == 10
