"""Clocks: the one that jumps, the one that runs scaled, and what each promises."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.loops import Deadlock, HorizonReached, JumpingLoop, ScaledLoop, run, run_virtual
from tests.virtual_time import elapse, turn


def jumping() -> JumpingLoop:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, JumpingLoop)
    return loop


async def forever() -> None:
    await asyncio.get_running_loop().create_future()


def test_time_starts_at_zero_and_the_result_is_returned() -> None:
    async def main() -> tuple[float, str]:
        began = asyncio.get_running_loop().time()
        await elapse(3600.0)
        return asyncio.get_running_loop().time() - began, "done"

    assert run_virtual(main()) == (3600.0, "done")


async def test_the_clock_lands_exactly_on_each_timer() -> None:
    loop, seen = jumping(), list[float]()
    start = loop.time()
    for delay in (7.25, 0.1, 1e-4):
        loop.call_at(start + delay, lambda: seen.append(loop.time() - start))
    await elapse(8.0)
    assert seen == [1e-4, 0.1, 7.25]


@given(delays=st.lists(st.sampled_from([0.0, 1.0, 1.5, 2.0]), max_size=40))
async def test_timers_run_by_time_and_equal_ones_in_order(delays: list[float]) -> None:
    loop, ran = jumping(), list[tuple[float, int]]()
    start = loop.time()
    for order, delay in enumerate(delays):
        loop.call_at(start + delay, ran.append, (delay, order))
    await elapse(3.0)
    assert ran == sorted(ran)
    assert len(ran) == len(delays)


async def test_a_cancelled_timer_is_not_jumped_to() -> None:
    loop = jumping()
    start = loop.time()
    loop.call_later(5.0, pytest.fail, "it was cancelled").cancel()
    await elapse(1.0)
    assert loop.time() == start + 1.0


async def test_ready_callbacks_run_before_any_jump() -> None:
    loop, times = jumping(), list[float]()
    start = loop.time()

    def again(left: int) -> None:
        times.append(loop.time() - start)
        if left:
            loop.call_soon(again, left - 1)

    loop.call_later(1.0, pytest.fail, "jumped while something was ready").cancel()
    loop.call_soon(again, 50)
    await elapse(1.0)
    assert times == [0.0] * 51


async def test_a_timeout_fires_at_its_virtual_time() -> None:
    loop = jumping()
    start = loop.time()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(2.5):
            await forever()
    assert loop.time() - start == 2.5


async def test_clock_stops_while_a_thread_works() -> None:
    loop, gate = jumping(), threading.Event()
    start, seen = loop.time(), list[float]()
    ticker = loop.call_later(1.0, lambda: seen.append(loop.time()))
    work = loop.run_in_executor(None, gate.wait, 30.0)
    loop.call_soon(gate.set)
    assert await work
    assert (loop.time(), seen, loop.outside) == (start, [], 0)
    ticker.cancel()


async def test_failure_in_a_thread_is_raised_and_the_clock_continues() -> None:
    with pytest.raises(ValueError, match="seven"):
        await jumping().run_in_executor(None, int, "seven")
    await elapse(1.0)
    assert jumping().outside == 0


async def test_work_that_no_executor_took_does_not_freeze_the_clock() -> None:
    ended = ThreadPoolExecutor(1)
    ended.shutdown()
    with pytest.raises(RuntimeError):
        jumping().run_in_executor(ended, int)
    assert jumping().outside == 0


async def test_clock_stops_inside_external() -> None:
    loop = jumping()
    start, answer = loop.time(), loop.create_future()
    timer = loop.call_later(0.001, pytest.fail, "time went on")
    thread = threading.Thread(target=lambda: loop.call_soon_threadsafe(answer.set_result, 42))
    with loop.external():
        thread.start()
        assert await answer == 42
    timer.cancel()
    thread.join()
    assert (loop.time(), loop.outside) == (start, 0)


def test_external_ends_with_its_block_also_by_a_failure() -> None:
    loop = JumpingLoop()
    with pytest.raises(ValueError, match="x"), loop.external():
        raise ValueError("x")
    assert loop.outside == 0
    loop.close()


def test_a_wait_for_nothing_is_a_deadlock() -> None:
    with pytest.raises(Deadlock):
        run_virtual(forever())


def test_endless_ticker_meets_the_horizon() -> None:
    ticks = list[float]()

    async def ticker() -> None:
        while True:
            await elapse(10.0)
            ticks.append(asyncio.get_running_loop().time())

    with pytest.raises(HorizonReached, match="95"):
        run_virtual(ticker(), horizon=95.0)
    assert ticks == [10.0 * n for n in range(1, 10)]


def test_the_horizon_itself_can_be_reached() -> None:
    run_virtual(elapse(95.0), horizon=95.0)


@pytest.mark.parametrize("wait", [forever(), elapse(1e9)], ids=["deadlock", "horizon"])
def test_tasks_are_cleaned_up_after_the_loop_gave_up(wait: Coroutine[Any, Any, None]) -> None:
    cleaned = list[str]()

    async def main() -> None:
        try:
            await wait
        finally:
            cleaned.append("yes")

    with pytest.raises((Deadlock, HorizonReached)):
        run_virtual(main())
    assert cleaned == ["yes"]


def test_failure_of_the_coroutine_is_raised() -> None:
    async def main() -> None:
        await elapse(1.0)
        raise KeyError("inside")

    with pytest.raises(KeyError, match="inside"):
        run_virtual(main())


def test_two_runs_are_the_same_run() -> None:
    async def main() -> list[tuple[float, int]]:
        ran: list[tuple[float, int]] = []

        async def one(number: int) -> None:
            for _ in range(3):
                await elapse(0.1 * (number % 3))
                ran.append((asyncio.get_running_loop().time(), number))

        await asyncio.gather(*map(one, range(8)))
        return ran

    assert run_virtual(main()) == run_virtual(main())


@pytest.mark.parametrize("speed", [0.0, -1.0, float("inf"), float("nan")])
def test_invalid_speed_is_refused(speed: float) -> None:
    with pytest.raises(ValueError, match="positive and finite"):
        ScaledLoop(speed)


def scaled(speed: float, wait: float) -> tuple[float, float]:
    """Return how long a timer of `wait` took by the scaled clock and by an ordinary loop's [s]."""

    async def main() -> float:
        loop = asyncio.get_running_loop()
        began, over = loop.time(), loop.create_future()
        loop.call_later(wait, over.set_result, None)
        await over
        return loop.time() - began

    ordinary = asyncio.new_event_loop()
    began = ordinary.time()
    took = run(main(), lambda: ScaledLoop(speed))
    real = ordinary.time() - began
    ordinary.close()
    return took, real


def test_scaled_wait_ends_not_before_its_time_and_sooner_by_the_wall() -> None:
    took, real = scaled(10_000.0, 1_000.0)
    assert took >= 1_000.0
    assert 0.1 <= real < 60.0


def test_a_slow_clock_is_possible() -> None:
    took, real = scaled(0.5, 0.01)
    assert took >= 0.01
    assert real >= 0.02


def test_work_that_takes_longer_than_its_time_does_not_find_ever_more_to_catch_up_with() -> None:
    speed = 100.0

    async def main() -> list[float]:
        loop, lapses = asyncio.get_running_loop(), list[float]()
        seen = loop.time()
        for _ in range(8):
            await turn()
            lapses.append(loop.time() - seen)
            seen += lapses[-1]
            end = time.monotonic() + max(0.001, 3.0 * lapses[-1] / speed)
            while time.monotonic() < end:
                pass
        return lapses

    lapses = run(main(), lambda: ScaledLoop(speed))
    assert all(0.0 <= lapse < 0.1 * speed for lapse in lapses)  # uncapped, the last would be 2 s and more by the wall


async def test_a_thousand_seconds_of_timers_need_no_wall_time_beyond_their_own_work() -> None:
    loop, count = jumping(), 0

    def tick() -> None:
        nonlocal count
        count += 1
        if count < 10_000:
            loop.call_later(0.1, tick)

    start = loop.time()
    tick()
    await elapse(1000.0)
    assert count == 10_000
    assert loop.time() - start == pytest.approx(1000.0)
