from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest

from dmc41x3.cli.scope import ChannelSample, Sampler, samples, ticks
from dmc41x3.driver import Driver
from dmc41x3.errors import CommandRejected, UnexpectedReply
from tests.unit.dmc41x3.cli.bench import driven
from tests.virtual_time import elapse


async def taken(driver: Driver, channels: list[str], rate: float, seconds: float) -> list[ChannelSample]:
    sampler = await Sampler.prepare(driver, channels)
    return [sample async for sample in samples(sampler, rate, seconds)]


async def test_a_ramp_is_sampled_at_its_times() -> None:
    async with driven() as driver:
        await driver.batch(["ACA=1024000", "SPA=10000", "PRA=100000", "BGA"])
        await elapse(1.0)
        found = await taken(driver, ["_TPA", "_TVA"], 50.0, 1.0)
        assert len(found) == 51
        assert found[-1].time == pytest.approx(1.0, abs=2 / 1024)
        for before, after in pairwise(found):
            speed = (after.values[0] - before.values[0]) / (after.time - before.time)
            assert speed == pytest.approx(10000.0, rel=0.06)  # a sample of 1/1024 s in 20 ms
        assert {sample.values[1] for sample in found} == {10000.0}


async def test_records_and_questions_make_one_sample() -> None:
    async with driven() as driver:
        await driver.batch(["x=7", "DP 11,22"])
        found = await taken(driver, ["x", "_TPB", "x+_TPA"], 10.0, 0.2)
        assert [sample.values for sample in found] == [(7.0, 22.0, 18.0)] * 3


async def test_without_records_the_controllers_clock_is_read() -> None:
    async with driven() as driver:
        await driver.send("x=7")
        sent: list[bytes] = []
        sampler = await Sampler.prepare(driver, ["x", "x*2"])
        driver.tap = lambda way, data: sent.append(data) if way == "tx" else None
        first = await sampler.sample()
        await elapse(2.0)
        assert first == ChannelSample(0.0, (7.0, 14.0))
        assert (await sampler.sample()).time == pytest.approx(2.0, abs=2 / 1024)
        assert sent == [b"MG TIME,x,x*2\r"] * 2


async def test_many_questions_are_split_over_lines_that_fit() -> None:
    async with driven() as driver:
        await driver.send("x=1")
        channels = [f"x+{n}000000" for n in range(1, 21)]
        sent: list[bytes] = []
        sampler = await Sampler.prepare(driver, channels)
        driver.tap = lambda way, data: sent.append(data) if way == "tx" else None
        assert (await sampler.sample()).values == tuple(1.0 + n * 1e6 for n in range(1, 21))
        assert len(sent) > 1
        assert max(len(line) for piece in sent for line in piece.split(b"\r")) <= 80


async def test_a_channel_that_does_not_exist_is_refused_at_once() -> None:
    async with driven() as driver:
        with pytest.raises(CommandRejected, match="nothing"):
            await Sampler.prepare(driver, ["_TPA", "nothing"])


async def test_invalid_channel_is_refused() -> None:
    async with driven() as driver:
        with pytest.raises(UnexpectedReply):
            await Sampler.prepare(driver, ['"words"'])


async def test_a_longer_sample_time_stretches_the_clock() -> None:
    async with driven() as driver:
        sampler = Sampler(driver, ["_TPA"], 3, 2000.0)
        first = await sampler.sample()
        await elapse(1.0)
        # The bench still counts 1024 samples a second; at TM 2000 they would be two seconds.
        assert (first.time, (await sampler.sample()).time) == (0.0, 2.0)


async def test_late_ticks_are_omitted() -> None:
    seen: list[int] = []
    async for tick in ticks(10.0, 1.0):
        seen.append(tick)
        if tick == 2:
            await elapse(0.55)
    assert seen == [0, 1, 2, 7, 8, 9, 10]
    assert asyncio.get_running_loop().time() == pytest.approx(1.0)
