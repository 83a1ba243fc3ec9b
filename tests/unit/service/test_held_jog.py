"""A held jog on the twin: it lives as long as it is renewed, and no longer."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from maya_un.controller.planner import MARGIN, TOLERANCE
from maya_un.errors import Busy, InvalidValue, MayaError, NotHomed, Stopped, UnknownName
from maya_un.schema.robot import HeldJog
from maya_un.service.direct import PATIENCE, HeldJogs
from maya_un.testing import Rig, rig
from maya_un.values import Mode
from tests.unit.controller.bench import HERE, commands_in, homed, now, still_moving
from tests.virtual_time import elapse

MOVING = HeldJog("b", 1, moving=True)
LONGEST_BRAKING = 0.9
"""A line at its full speed of 45 000 counts/s brakes at 51 200 counts/s² [s]."""


@asynccontextmanager
async def held() -> AsyncIterator[tuple[Rig, HeldJogs]]:
    async with homed() as bench:
        jogs = HeldJogs(bench.controller)
        yield bench, jogs
        await jogs.release()


async def keep(jogs: HeldJogs, seconds: float, direction: int = 1, *, every: float = 0.2) -> HeldJog:
    """Hold line b's key for so long; return the last answer."""
    until = now() + seconds
    answer = await jogs.hold("b", direction, 1.0)
    while now() < until:
        await elapse(every)
        answer = await jogs.hold("b", direction, 1.0)
    return answer


def length(bench: Rig) -> float:
    """Return the length of line b by the mechanics' own record [m]."""
    bench.virtual.sync()
    return bench.mechanics.true_joints()[1]


@pytest.mark.parametrize("every", [0.05, 0.2, 0.49])
async def test_renewed_jog_continues(every: float) -> None:
    async with held() as (bench, jogs):
        assert await keep(jogs, 8.0, every=every) == MOVING
        assert bench.controller.state.mode is Mode.MOVING
        assert [command for command in commands_in(bytes(bench.sent)) if command == "BGS"] == ["BGS"]
        assert length(bench) > HERE.b + 0.1


@pytest.mark.parametrize("after", [0.0, 1.0, 6.0])
async def test_not_renewed_it_stops(after: float) -> None:
    async with held() as (bench, jogs):
        await keep(jogs, after)
        last = now()
        while still_moving(bench) > 0.0:
            await elapse(0.01)
        assert now() - last <= PATIENCE + LONGEST_BRAKING + 0.05
        stands = length(bench)
        await elapse(30.0)
        assert length(bench) == pytest.approx(stands, abs=1e-5)
        assert bench.controller.state.mode is Mode.IDLE
        assert await jogs.hold("b", 1, 1.0) == MOVING


async def test_let_go_it_stops_at_once() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 6.0)
        begun = now()
        await jogs.release()
        assert 0.5 < now() - begun <= LONGEST_BRAKING
        assert still_moving(bench) == 0.0
        await jogs.release()


async def test_the_other_direction_turns_round_after_a_rest() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 6.0)
        out = length(bench)
        assert (await keep(jogs, 6.0, -1)).moving
        assert length(bench) < out
        assert commands_in(bytes(bench.sent)).count("BGS") == 2


async def test_jog_rests_at_the_border_while_it_is_held() -> None:
    async with held() as (bench, jogs):
        answer = await keep(jogs, 40.0)
        assert (answer.moving, answer.limit) == (False, "line_b")
        assert answer.reason
        assert 2.259 - length(bench) == pytest.approx(MARGIN, abs=2 * TOLERANCE)
        assert commands_in(bytes(bench.sent)).count("BGS") == 1
        assert (await keep(jogs, 1.0, -1)).moving


async def test_foreign_stop_ends_the_jog_until_the_key_is_released() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 4.0)
        await bench.controller.stop()
        while still_moving(bench) > 0.0:
            await jogs.hold("b", 1, 1.0)
            await elapse(0.1)
        for _ in range(10):
            await elapse(0.2)
            with pytest.raises(Stopped):
                await jogs.hold("b", 1, 1.0)
        assert still_moving(bench) == 0.0
        await jogs.release()
        assert await jogs.hold("b", 1, 1.0) == MOVING


async def test_a_halt_ends_it_until_the_key_is_let_go() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 4.0)
        jogs.halt()
        assert not (await keep(jogs, 3.0)).moving
        assert still_moving(bench) == 0.0
        await elapse(2.0 * PATIENCE)
        assert (await keep(jogs, 1.0)).moving


async def test_a_key_that_is_let_go_while_the_one_before_brakes_moves_nothing() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 6.0)
        turned = asyncio.create_task(jogs.hold("b", -1, 1.0))
        await elapse(0.1)
        await jogs.release()
        assert not (await turned).moving
        await elapse(1.0)
        assert commands_in(bytes(bench.sent)).count("BGS") == 1


async def test_a_halt_while_the_jog_before_brakes_keeps_the_key_behind_it_from_moving() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 6.0)
        turned = asyncio.create_task(jogs.hold("b", -1, 1.0))
        await elapse(0.1)
        jogs.halt()
        await bench.controller.stop()
        for _ in range(10):
            await elapse(0.2)
            await jogs.hold("b", -1, 1.0)
        assert not (await turned).moving
        assert still_moving(bench) == 0.0
        assert commands_in(bytes(bench.sent)).count("BGS") == 1
        await jogs.release()
        assert (await keep(jogs, 1.0, -1)).moving


async def test_expired_jog_moves_nothing_while_the_previous_one_brakes() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 6.0)
        assert not (await jogs.hold("b", -1, 1.0)).moving
        await elapse(5.0)
        assert commands_in(bytes(bench.sent)).count("BGS") == 1


@pytest.mark.parametrize(("axis", "direction", "error"), [("d", 1, UnknownName), ("b", 0, InvalidValue)])
async def test_invalid_jog_is_refused(axis: str, direction: int, error: type[MayaError]) -> None:
    async with held() as (_, jogs):
        with pytest.raises(error):
            await jogs.hold(axis, direction, 1.0)


async def test_jog_refused_by_the_planner_is_refused() -> None:
    async with held() as (bench, jogs):
        move = asyncio.create_task(bench.controller.move(HERE._replace(b=1.6)))
        await elapse(0.1)
        with pytest.raises(Busy):
            await jogs.hold("b", 1, 1.0)
        await move
    async with rig() as bench:
        with pytest.raises(NotHomed):
            await HeldJogs(bench.controller).hold("b", 1, 1.0)


async def test_request_that_arrives_after_the_release_of_its_press_moves_nothing() -> None:
    async with held() as (bench, jogs):
        assert await jogs.hold("b", 1, 1.0, "first") == MOVING
        await jogs.release("first")
        assert not (await jogs.hold("b", 1, 1.0, "first")).moving
        assert commands_in(bytes(bench.sent)).count("BGS") == 1
        assert await jogs.hold("b", 1, 1.0, "second") == MOVING


async def test_release_that_arrives_before_its_press_ends_it() -> None:
    async with held() as (bench, jogs):
        await jogs.release("first")
        assert not (await jogs.hold("b", 1, 1.0, "first")).moving
        assert "BGS" not in commands_in(bytes(bench.sent))


async def test_late_release_does_not_end_the_next_press() -> None:
    async with held() as (bench, jogs):
        await jogs.hold("b", 1, 1.0, "first")
        await jogs.hold("b", -1, 1.0, "second")
        await jogs.release("first")
        assert (await jogs.hold("b", -1, 1.0, "second")).moving
        assert still_moving(bench) > 0.0


async def test_press_that_was_not_renewed_in_time_moves_nothing_any_more() -> None:
    async with held() as (bench, jogs):
        await jogs.hold("b", 1, 1.0, "first")
        await elapse(5.0)
        assert not (await jogs.hold("b", 1, 1.0, "first")).moving
        assert still_moving(bench) == 0.0


async def test_new_press_moves_after_a_halt_though_no_release_arrived() -> None:
    async with held() as (_, jogs):
        await jogs.hold("b", 1, 1.0, "first")
        jogs.halt()
        await elapse(0.2)
        assert not (await jogs.hold("b", 1, 1.0, "first")).moving
        assert (await jogs.hold("b", 1, 1.0, "second")).moving


async def test_one_press_may_change_direction_and_speed() -> None:
    async with held() as (_, jogs):
        await jogs.hold("b", 1, 1.0, "first")
        assert (await jogs.hold("b", -1, 0.5, "first")).moving
