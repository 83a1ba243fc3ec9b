"""A held jog on the twin: it lives as long as it is renewed, and no longer."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from itertools import cycle
from math import hypot

import pytest

from maya_un.config.model import parse_zone
from maya_un.controller.planner import MARGIN, TOLERANCE
from maya_un.errors import Busy, InvalidValue, MayaError, NotHomed, Stopped, UnknownName
from maya_un.kinematics.zones import zone_of
from maya_un.schema.robot import HeldJog, SteeredJog
from maya_un.service.direct import PATIENCE, HeldJogs
from maya_un.testing import Rig, rig
from maya_un.values import Mode, Point
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


@pytest.mark.parametrize("presses", [("one", "one"), ("one", "another")])
async def test_client_that_sends_one_request_after_another_turns_at_full_speed(presses: tuple[str, str]) -> None:
    """The robot brakes for longer than a key lives without a renewal."""
    async with held() as (bench, jogs):
        for direction, press in zip((1, -1), presses, strict=True):
            for _ in range(40):
                await jogs.hold("b", direction, 1.0, press)
                await elapse(0.15)
            assert (await jogs.hold("b", direction, 1.0, press)).moving
        assert commands_in(bytes(bench.sent)).count("BGS") == 2


@pytest.mark.parametrize(("speed", "pause"), [(0.2, 0.3), (0.4, 0.4)])
async def test_client_that_renews_rarely_turns_if_the_robot_brakes_shortly(speed: float, pause: float) -> None:
    async with held() as (_, jogs):
        for direction in (1, -1):
            for _ in range(10):
                await jogs.hold("b", direction, speed, "press")
                await elapse(pause)
            assert (await jogs.hold("b", direction, speed, "press")).moving


async def test_key_that_was_turned_back_and_forth_begins_once() -> None:
    """The jog ends at the border, and no earlier request for the same key begins another one."""
    async with held() as (bench, jogs):
        for _ in range(24):
            await jogs.hold("b", 1, 1.0, "press")
            await elapse(0.2)
        for axis, direction in (("b", -1), ("c", 1), ("b", -1)):  # while the first jog brakes
            await jogs.hold(axis, direction, 1.0, "press")
        while not (await jogs.hold("b", -1, 1.0, "press")).limit:
            await elapse(0.2)
        for _ in range(10):
            assert not (await jogs.hold("b", -1, 1.0, "press")).moving
            await elapse(0.2)
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


def point(bench: Rig) -> Point:
    """Return the gripper point by the mechanics' own record [m]."""
    bench.virtual.sync()
    return Point(*bench.mechanics.gripper_point())


def starts(bench: Rig) -> int:
    """Return how many motions have begun."""
    return commands_in(bytes(bench.sent)).count("BGS")


def ratios(bench: Rig) -> list[str]:
    """Return the speed ratios that were commanded."""
    return [command for command in commands_in(bytes(bench.sent)) if command.startswith("VR ")]


async def steer(jogs: HeldJogs, seconds: float, *vectors: tuple[float, float, float]) -> SteeredJog:
    """Hold a stick for so long, which wavers between vectors; return the last answer."""
    until, ahead = now() + seconds, cycle(vectors)
    answer = await jogs.steer(next(ahead), "stick")
    while now() < until:
        await elapse(0.1)
        answer = await jogs.steer(next(ahead), "stick")
    return answer


async def way(bench: Rig, jogs: HeldJogs, seconds: float, *vectors: tuple[float, float, float]) -> Point:
    """Return how far the gripper goes while a stick is held [m]."""
    before = point(bench)
    assert (await steer(jogs, seconds, *vectors)).moving
    after = point(bench)
    return Point(after.x - before.x, after.y - before.y, after.z - before.z)


@pytest.mark.parametrize("vector", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-0.48, -0.64, 0.6), (0.3, 0.4, 0.0)])
async def test_stick_moves_the_gripper_straight_along_its_vector(vector: tuple[float, float, float]) -> None:
    async with held() as (bench, jogs):
        gone = await way(bench, jogs, 3.0, vector)
        length = hypot(*gone)
        assert length > 0.01
        assert [one / length for one in gone] == pytest.approx([one / hypot(*vector) for one in vector], abs=0.02)
        assert starts(bench) == 1


async def test_length_of_the_vector_scales_the_speed_at_once_and_without_a_stop() -> None:
    async with held() as (bench, jogs):
        for length in (0.2, 0.8, 0.1):
            await steer(jogs, 3.0, (0.0, 0.0, length))
            run = bench.controller.run
            assert run is not None
            predicted = run.move.position_at(now() - run.began)
            point(bench)
            assert bench.mechanics.true_joints() == pytest.approx(predicted, abs=1e-3)
        assert ratios(bench) == ["VR 0.2", "VR 0.8", "VR 0.1"]
        assert starts(bench) == 1
        assert bench.controller.state.override == 1.0


async def test_small_change_of_speed_sends_nothing() -> None:
    async with held() as (bench, jogs):
        await steer(jogs, 2.0, (0.0, 0.0, 0.5), (0.0, 0.0, 0.515), (0.0, 0.0, 0.49))
        assert ratios(bench) == ["VR 0.5"]


async def test_speed_of_a_stick_does_not_outlast_it() -> None:
    async with held() as (bench, jogs):
        await steer(jogs, 2.0, (0.0, 0.0, 0.1))
        await jogs.release("stick")
        await bench.controller.move(HERE)
        assert ratios(bench) == ["VR 0.1", "VR 1"]
        assert not await bench.controller.jog_speed(0.5)


async def test_override_and_pause_hold_for_a_stick_too() -> None:
    async with held() as (bench, jogs):
        await bench.controller.override(0.5)
        await steer(jogs, 2.0, (0.0, 0.0, 0.4))
        await bench.controller.override(1.0)
        await steer(jogs, 1.0, (0.0, 0.0, 0.4))
        await bench.controller.pause()
        await steer(jogs, 3.0, (0.0, 0.0, 0.3))
        stands = point(bench)
        await steer(jogs, 1.0, (0.0, 0.0, 0.2))
        assert point(bench) == pytest.approx(stands, abs=1e-6), "another speed ended the pause"
        await bench.controller.resume()
        await steer(jogs, 1.0, (0.0, 0.0, 0.2))
        assert point(bench).z > stands.z + 1e-3
        assert list(dict.fromkeys(ratios(bench))) == ["VR 0.2", "VR 0.4", "VR 0"]
        assert ratios(bench)[-1] == "VR 0.2"


async def test_stick_that_trembles_moves_in_the_direction_of_its_beginning() -> None:
    async with held() as (bench, jogs):
        gone = await way(bench, jogs, 3.0, (0.0, 0.0, 0.5), (0.09, 0.0, 0.5), (0.0, -0.09, 0.51))
        assert starts(bench) == 1
        assert hypot(gone.x, gone.y) < 0.01 * gone.z


async def test_another_direction_begins_when_the_robot_is_at_rest() -> None:
    async with held() as (bench, jogs):
        await steer(jogs, 3.0, (0.0, 0.0, 1.0))
        assert not (await jogs.steer((0.6, 0.0, 0.8), "stick")).moving, "it did not brake first"
        await steer(jogs, 1.0, (0.6, 0.0, 0.8))
        gone = await way(bench, jogs, 1.0, (0.6, 0.0, 0.8))
        assert gone.x / gone.z == pytest.approx(0.75, abs=0.03)
        assert starts(bench) == 2


async def test_stick_rests_at_the_border_and_names_it() -> None:
    async with held() as (bench, jogs):
        answer = await steer(jogs, 60.0, (0.0, 0.0, 1.0))
        assert (answer.moving, bool(answer.limit), bool(answer.reason)) == (False, True, True)
        assert bench.controller.workspace.why_not(point(bench)) is None
        assert still_moving(bench) == 0.0
        assert (await steer(jogs, 1.0, (0.0, 0.0, -1.0))).moving


async def test_stick_does_not_enter_a_zone() -> None:
    async with held() as (bench, jogs):
        x, y, z = point(bench)
        box = {"name": "lid", "kind": "box", "low": [x - 0.3, y - 0.3, 0.0], "high": [x + 0.3, y + 0.3, z - 0.25]}
        bench.controller.set_zones([zone_of(parse_zone(box))])
        answer = await steer(jogs, 40.0, (0.0, 0.0, -1.0))
        assert (answer.moving, answer.limit) == (False, "zone")
        assert point(bench).z > z - 0.25


async def test_stick_that_is_not_renewed_stops_and_its_press_is_over() -> None:
    async with held() as (bench, jogs):
        await steer(jogs, 3.0, (0.0, 0.0, 0.5))
        last = now()
        while still_moving(bench) > 0.0:
            await elapse(0.01)
        assert now() - last <= PATIENCE + LONGEST_BRAKING + 0.05
        assert not (await jogs.steer((0.0, 0.0, 0.5), "stick")).moving
        assert starts(bench) == 1


async def test_late_vector_after_its_release_moves_nothing() -> None:
    async with held() as (bench, jogs):
        await steer(jogs, 1.0, (0.0, 0.0, 0.5))
        await jogs.release("stick")
        for length in (0.5, 0.9):
            assert not (await jogs.steer((0.0, 0.0, length), "stick")).moving
        assert starts(bench) == 1


async def test_stop_of_another_user_ends_it_until_the_stick_is_released() -> None:
    async with held() as (bench, jogs):
        await steer(jogs, 2.0, (0.0, 0.0, 0.5))
        jogs.halt()
        for length in (0.5, 0.2, 0.9):
            assert not (await steer(jogs, 1.0, (0.0, 0.0, length))).moving
        assert starts(bench) == 1
        assert (await jogs.steer((0.0, 0.0, 0.5), "another press")).moving


@pytest.mark.parametrize("vector", [(0.0, 0.0, 0.0), (0.0, 0.0, 0.009), (0.8, 0.8, 0.0)])
async def test_vector_of_another_length_is_refused(vector: tuple[float, float, float]) -> None:
    async with held() as (bench, jogs):
        with pytest.raises(InvalidValue):
            await jogs.steer(vector)
        assert starts(bench) == 0


async def test_answer_tells_the_vector_that_the_robot_follows() -> None:
    async with held() as (_, jogs):
        await jogs.steer((0.3, 0.4, 0.0))
        answer = await jogs.steer((0.58, 0.8, 0.0))
        assert answer.moving
        assert answer.vector == pytest.approx((0.593, 0.790, 0.0), abs=0.01)


async def until_rest(bench: Rig, key: Callable[[], Awaitable[object]]) -> None:
    """Keep holding a key until nothing moves."""
    while still_moving(bench) > 0.0:
        await key()
        await elapse(0.1)


@pytest.mark.parametrize("press", [None, "first"])
@pytest.mark.parametrize(("axis", "direction", "speed"), [("b", 1, 0.5), ("b", -1, 1.0), ("c", 1, 1.0)])
async def test_press_that_somebody_stopped_moves_nothing_as_another_key(
    press: str | None, axis: str, direction: int, speed: float
) -> None:
    async with held() as (bench, jogs):
        await jogs.hold("b", 1, 1.0, press)
        jogs.halt()
        await bench.controller.stop()
        await until_rest(bench, lambda: jogs.hold("b", 1, 1.0, press))
        for _ in range(10):
            assert not (await jogs.hold(axis, direction, speed, press)).moving
            await elapse(0.2)
        assert starts(bench) == 1
        await jogs.release(press)
        assert (await jogs.hold(axis, direction, speed, "second")).moving


async def test_stick_that_turns_after_a_stop_moves_nothing() -> None:
    async with held() as (bench, jogs):
        await steer(jogs, 2.0, (0.0, 0.0, 0.5))
        jogs.halt()
        await bench.controller.stop()
        assert not (await steer(jogs, 3.0, (0.15, 0.0, 0.45), (0.5, 0.0, 0.0))).moving
        assert starts(bench) == 1
        assert (await jogs.steer((0.5, 0.0, 0.0), "another press")).moving


async def test_key_without_a_press_stays_stopped_until_it_is_not_renewed() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 2.0)
        jogs.halt()
        await bench.controller.stop()
        assert not (await keep(jogs, 3.0, -1)).moving
        await elapse(2.0 * PATIENCE)
        assert (await keep(jogs, 1.0, -1)).moving


async def test_stop_past_this_service_ends_the_press_in_every_direction() -> None:
    async with held() as (bench, jogs):
        await keep(jogs, 4.0)
        await bench.controller.stop()
        await until_rest(bench, lambda: jogs.hold("b", 1, 1.0))
        await elapse(0.2)
        for direction, speed in ((-1, 1.0), (1, 0.5)):
            with pytest.raises(Stopped):
                await jogs.hold("b", direction, speed)
        assert starts(bench) == 1


@pytest.mark.parametrize("before", [1.0, 40.0])
async def test_fault_ends_the_press_though_it_is_cleared_meanwhile(before: float) -> None:
    async with held() as (bench, jogs):
        await keep(jogs, before)
        bench.virtual.cut()
        await elapse(0.05)

        async def key() -> None:
            with suppress(MayaError):
                assert not (await jogs.hold("b", 1, 1.0)).moving

        await until_rest(bench, key)
        for _ in range(20):
            await key()
            await elapse(0.2)
        await bench.controller.recover()
        for direction, speed in ((-1, 1.0), (1, 0.5)):
            with suppress(MayaError):
                assert not (await jogs.hold("b", direction, speed)).moving
        assert starts(bench) == 1
        await jogs.release()
        assert (await jogs.hold("b", -1, 1.0)).moving
