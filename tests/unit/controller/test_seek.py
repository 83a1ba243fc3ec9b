from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from dmc41x3.driver import Driver
from dmc41x3.language.record import AxisRecord, AxisStatus, AxisSwitches
from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.controller.command_slot import RunningCommand
from maya_un.controller.seek import FORWARD, REVERSE, SETTLE, Seeker, Stall, look_at
from maya_un.errors import AbortInput, FollowingError, HomingStalled, Stopped, WiringContradictsCn
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.testing import Rig, rig
from tests.unit.controller.bench import box, commands_in, foreign, now, record_of
from tests.unit.dmc41x3.scripted import conversation
from tests.virtual_time import elapse

A, B, C = 0, 1, 2
PERMUTED = parse({"axes": {"a": {"letter": "B"}, "b": {"letter": "C"}, "c": {"letter": "A"}}})


@asynccontextmanager
async def seeking(
    start: StartPose | None = None, *, truth: TrueConstants | None = None, config: Config | None = None
) -> AsyncIterator[tuple[Seeker, Rig, RunningCommand]]:
    """Yield a seeker on a twin whose motors are on, and its command."""
    async with rig(config, truth=truth, start=start or StartPose()) as bench:
        monitor = bench.controller._monitor
        driver = monitor.link.driver
        await monitor.power(driver)
        command = RunningCommand("home")
        del bench.sent[:]
        yield (
            Seeker(driver, bench.controller.config, bench.controller.units, command.wait, now, unguarded),
            bench,
            command,
        )


async def unguarded(driver: Driver, commands: Sequence[str]) -> None:
    await driver.batch(commands)


def moved(bench: Rig, start: StartPose) -> tuple[float, ...]:
    return tuple(there - here for here, there in zip(start, bench.mechanics.true_joints(), strict=True))


def test_a_look_puts_the_axes_in_mayas_order() -> None:
    record = record_of(
        AxisRecord(position=30, reference=31, error=1, torque_raw=32767, stop_code=3, status=AxisStatus.MOVING),
        AxisRecord(position=10, switches=AxisSwitches.REVERSE_INACTIVE),
        AxisRecord(position=20, switches=AxisSwitches.FORWARD_INACTIVE),
    )
    letters = {"a": {"letter": "B"}, "b": {"letter": "C"}, "c": {"letter": "A"}}
    look = look_at(record, parse({"axes": letters}))
    assert (look.counts, look.reference, look.error) == ((10, 20, 30), (0, 0, 31), (0, 0, 1))
    assert (look.stop_code, look.running) == ((0, 0, 3), (False, False, True))
    assert look.torque == pytest.approx((0.0, 0.0, 10.0), abs=1e-3)
    assert look.moving
    assert [look.at(axis, FORWARD) for axis in range(3)] == [True, False, False]
    assert [look.at(axis, REVERSE) for axis in range(3)] == [False, True, False]


@pytest.mark.parametrize(("stop_code", "forward", "reverse"), [(1, False, False), (2, True, False), (3, False, True)])
def test_switch_that_released_again_was_still_met(stop_code: int, forward: bool, reverse: bool) -> None:
    look = look_at(record_of(AxisRecord(stop_code=stop_code), AxisRecord(), AxisRecord()), Config())
    assert (look.met(A, FORWARD), look.met(A, REVERSE)) == (forward, reverse)
    assert not look.met(B, FORWARD)


async def test_axes_go_together_and_arrive_together() -> None:
    async with seeking() as (seeker, bench, _):
        look = await seeker.go({B: 0.06, C: -0.03}, 0.03)
        assert moved(bench, StartPose()) == pytest.approx((0.0, 0.06, -0.03), abs=2e-6)
        assert not look.moving
        assert now() == pytest.approx(0.06 / 0.03 + 0.03 / 0.0512 + SETTLE, abs=0.3)


@pytest.mark.parametrize(
    ("config", "deltas", "lines"),
    [
        (Config(), {B: 0.03, C: -0.04}, ["LM BC", "LI ,30000,-40000"]),
        (Config(), {A: 0.01}, ["LM A", "LI 213"]),
        (PERMUTED, {B: 0.03, C: -0.04}, ["LM AC", "LI -40000,,30000"]),
        (PERMUTED, {A: 0.01}, ["LM B", "LI ,213"]),
    ],
    ids=["two lines", "the boom", "two lines, permuted", "the boom, permuted"],
)
async def test_a_move_is_sent_whole_before_it_begins(
    config: Config, deltas: Mapping[int, float], lines: list[str]
) -> None:
    still = record_of(AxisRecord(), AxisRecord(), AxisRecord()).encode() + b":"
    answers = box(config)
    async with conversation(lambda command: still if command == "QR" else answers(command)) as (driver, peer):
        seeker = Seeker(driver, config, Units.of(config), RunningCommand("home").wait, now, unguarded)
        await seeker.go(deltas, 0.03)
    setup = [command for command in peer.commands if command[:2] not in {"QR", "VS", "VA", "VD", "TL"}]
    assert setup == ["CA S", "CS S", "VR 1", lines[0], lines[1], "LE", "BGS", *[""] * (setup.count(""))]
    assert peer.commands.index("BGS") > peer.commands.index("LE")


async def test_move_of_less_than_a_count_is_not_sent() -> None:
    async with seeking() as (seeker, bench, _):
        await seeker.go({A: 0.0, B: 4e-7, C: -4e-7}, 0.03)
        assert commands_in(bytes(bench.sent)) == ["QR"]


async def test_speed_is_limited_to_that_of_the_axes() -> None:
    async with seeking() as (seeker, bench, _):
        await seeker.go({B: 0.2}, 1.0)
        await seeker.go({A: 0.05}, 1.0)
        speeds = [int(command[3:]) for command in commands_in(bytes(bench.sent)) if command.startswith("VS")]
        assert speeds == [45_000, 1_000]


async def test_a_switch_ends_the_move_of_all() -> None:
    start = StartPose(1.0, 1.5, 0.600)
    async with seeking(start) as (seeker, bench, _):
        await seeker.survey()
        look = await seeker.go({B: 0.5, C: -0.5}, 0.03)
        assert look.met(C, REVERSE)
        assert not look.moving
        way = moved(bench, start)
        assert way[B] == pytest.approx(-way[C], abs=3e-6)
        assert way[C] == pytest.approx(-0.035, abs=0.01)


async def test_move_ends_on_request() -> None:
    async with seeking() as (seeker, bench, _):
        look = await seeker.go({B: 0.5}, 0.03, poll=0.05, until=lambda look: look.counts[B] > 60_000)
        assert 60_000 < look.counts[B] < 60_000 + 0.1 * 30_000 + 30_000**2 / (2 * 51_200)
        assert commands_in(bytes(bench.sent)).count("ST S") == 1


async def test_stop_reaches_a_move_between_two_looks() -> None:
    async with seeking() as (seeker, _, command):
        asyncio.get_running_loop().call_later(1.01, command.interrupt, Stopped())
        with pytest.raises(Stopped):
            await seeker.go({B: 0.5}, 0.03)
        assert now() == 1.01


async def test_stopped_command_begins_no_move() -> None:
    async with seeking() as (seeker, bench, command):
        command.interrupt(Stopped())
        with pytest.raises(Stopped):
            await seeker.go({B: 0.5}, 0.03)
        assert "BGS" not in commands_in(bytes(bench.sent))


@pytest.mark.parametrize(
    ("truth", "axis"),
    [(TrueConstants().with_wiring(True), "a"), (TrueConstants().with_wiring(True, axis=C), "c")],
    ids=["both ends of all", "both ends of c"],
)
async def test_readings_that_cannot_be_are_refused_before_anything_moves(truth: TrueConstants, axis: str) -> None:
    async with seeking(truth=truth) as (seeker, bench, _):
        with pytest.raises(WiringContradictsCn) as refusal:
            await seeker.survey()
        assert refusal.value.details["axis"] == axis
        assert commands_in(bytes(bench.sent)) == ["QR"]


@pytest.mark.parametrize(("side", "way"), [("forward", 0.1), ("reverse", -0.1)])
async def test_no_move_goes_towards_a_switch_that_reads_active(side: str, way: float) -> None:
    wired = TrueConstants().with_wiring(True, axis=B, switch="forward" if side == FORWARD else "reverse")
    async with seeking(truth=wired) as (seeker, bench, _):
        with pytest.raises(WiringContradictsCn) as refusal:
            await seeker.go({B: way}, 0.03)
        assert (refusal.value.details["axis"], refusal.value.details["side"]) == ("b", side)
        assert "BGS" not in commands_in(bytes(bench.sent))


async def test_a_switch_that_does_not_let_go_contradicts() -> None:
    async with seeking(truth=TrueConstants().with_wiring(True, axis=C, switch="forward")) as (seeker, bench, _):
        await seeker.survey()
        with pytest.raises(WiringContradictsCn) as refusal:
            await seeker.go({C: -0.3}, 0.03)
        assert refusal.value.details["side"] == FORWARD
        assert moved(bench, StartPose())[C] == pytest.approx(-0.045, abs=0.02)
        assert not (await seeker.look()).moving


async def test_a_switch_that_turns_active_behind_an_axis_contradicts() -> None:
    # Wired the wrong way round, the reverse switch lets go where it should trip: it trips on the way out.
    start = StartPose(1.0, 1.5, 0.560)
    async with seeking(start, truth=TrueConstants().with_wiring(True, axis=C, switch="reverse")) as (seeker, bench, _):
        await seeker.survey()
        with pytest.raises(WiringContradictsCn) as refusal:
            await seeker.go({C: 0.1}, 0.03)
        assert (refusal.value.details["axis"], refusal.value.details["side"]) == ("c", REVERSE)
        assert not (await seeker.look()).moving
        assert moved(bench, start)[C] < 0.05


async def test_blocked_axis_stalls_and_can_be_moved_away() -> None:
    blocked = replace(TrueConstants(), gaps=(-0.3, 0.02, 0.02))
    start = StartPose(0.35, 1.5, 1.5)
    async with seeking(start, truth=blocked) as (seeker, bench, _):
        await seeker.survey()
        with pytest.raises(Stall) as stall:
            await seeker.go({A: -0.2}, 0.04)
        assert stall.value.axis == A
        look = await seeker.look()
        assert (look.moving, abs(look.error[A]) <= 1) == (False, True)
        await seeker.go({A: 0.05}, 0.04)
        assert bench.mechanics.true_joints()[0] == pytest.approx(0.35, abs=1e-3)
        assert isinstance(seeker.stalled(stall.value, "it pushes"), HomingStalled)


@pytest.mark.parametrize(("register", "error"), [("ERB=5", FollowingError), ("", AbortInput)])
async def test_other_end_of_a_move_is_raised(register: str, error: type[Exception]) -> None:
    async with seeking() as (seeker, bench, _):
        if register:
            await foreign(bench, register)
        else:
            bench.virtual._loop.call_later(1.0, bench.virtual.abort_input, True)
        with pytest.raises(error):
            await seeker.go({B: 0.2}, 0.03)


async def test_settle_returns_at_rest() -> None:
    async with seeking() as (seeker, bench, _):
        await foreign(bench, "LM B", "VS 40000", "LI ,400000", "LE", "BGS")
        await elapse(3.0)
        look = await seeker.settle()
        assert not look.moving
        assert look.stop_code[B] == 4
