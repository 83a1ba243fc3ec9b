"""Waypoints reported during a motion, and the rest of a motion when its link was lost."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.config.files import parse
from maya_un.controller.protocol import OnVia
from maya_un.errors import Busy, LinkLost, Stopped
from maya_un.events import MotionEnded
from maya_un.motion.path import Path
from maya_un.testing import Rig
from maya_un.values import Joints, Mode, Point
from tests.unit.controller.bench import HERE, commands_in, homed, kinds, now, references, still_moving
from tests.virtual_time import elapse

VIAS = (Joints(0.4, 1.4, 1.4), Joints(0.4, 1.4, 1.6), Joints(0.5, 1.5, 1.6))
PATH = [HERE, *VIAS, Joints(0.3, 1.5, 1.5)]


def places(bench: Rig) -> tuple[float, float, float]:
    """Return where the twin's references are now (rad, m, m)."""
    a, b, c = (start + way for start, way in zip(HERE, references(bench), strict=True))
    return a, b, c


def listener(bench: Rig, told: list[tuple[int, tuple[float, float, float]]]) -> OnVia:
    """Return what notes every via with the twin's place at that instant."""
    return lambda via: told.append((via, places(bench)))


@pytest.mark.parametrize("ratio", [1.0, 0.4])
async def test_every_waypoint_is_reported_at_its_place(ratio: float) -> None:
    async with homed() as bench:
        told: list[tuple[int, tuple[float, float, float]]] = []
        await bench.controller.override(ratio)
        await bench.controller.follow(PATH, on_via=listener(bench, told))
        assert [via for via, _ in told] == [0, 1, 2]
        for (_, place), via in zip(told, VIAS, strict=True):
            assert place == pytest.approx(tuple(via), abs=3e-4)


async def test_waypoints_are_reported_through_pauses_and_speed_changes() -> None:
    async with homed() as bench:
        told: list[tuple[int, tuple[float, float, float]]] = []
        motion = asyncio.create_task(bench.controller.follow(PATH, on_via=listener(bench, told)))
        for _ in range(4):
            await elapse(1.7)
            await bench.controller.pause()
            await elapse(3.0)
            seen = len(told)
            await elapse(60.0)
            assert len(told) == seen
            await bench.controller.override(0.6 if bench.controller.state.override == 1.0 else 1.0)
            await bench.controller.resume()
        await motion
        assert [via for via, _ in told] == [0, 1, 2]
        for (_, place), via in zip(told, VIAS, strict=True):
            assert place == pytest.approx(tuple(via), abs=3e-4)


async def test_waypoint_passed_while_a_pause_brakes_is_reported_there() -> None:
    async with homed() as bench:
        told: list[tuple[int, tuple[float, float, float]]] = []
        via = Joints(0.3, 1.6, 1.3)
        path = [HERE, via, Joints(0.3, 1.7, 1.3)]
        motion = asyncio.create_task(bench.controller.follow(path, on_via=listener(bench, told)))
        while places(bench)[1] < via.b - 0.003:
            await elapse(0.02)
        report = await bench.controller.pause()
        await elapse(report.duration + 1.0)
        assert places(bench)[1] > via.b + 0.003
        ((_, place),) = told
        assert place == pytest.approx(tuple(via), abs=3e-4)
        await bench.controller.resume()
        await motion


async def test_blended_waypoint_is_reported_as_it_is_passed() -> None:
    async with homed() as bench:
        told: list[tuple[int, tuple[float, float, float]]] = []
        x, y, z = bench.controller.mechanism.fk(HERE)
        corner = Point(x, y, z - 0.2)
        path = Path.line(Point(x, y, z), corner, Point(x + 0.2, y, z - 0.2), blend=0.05)
        await bench.controller.follow(path, on_via=listener(bench, told))
        ((via, place),) = told
        passed = bench.controller.mechanism.fk(Joints(*place))
        assert via == 0
        # The parabola that cuts a right corner by 50 mm passes it at 50/2 · cos 45° = 18 mm.
        assert max(abs(one - two) for one, two in zip(passed, corner, strict=True)) < 0.02


async def test_no_waypoint_is_reported_after_a_stop() -> None:
    async with homed() as bench:
        told: list[tuple[int, tuple[float, float, float]]] = []
        motion = asyncio.create_task(bench.controller.follow(PATH, on_via=listener(bench, told)))
        while not told:
            await elapse(0.1)
        await bench.controller.stop()
        await asyncio.wait({motion})
        await elapse(30.0)
        assert isinstance(motion.exception(), Stopped)
        assert [via for via, _ in told] == [0]


async def test_error_in_a_listener_ends_the_motion_at_rest() -> None:
    def fail(_: int) -> None:
        raise ZeroDivisionError

    async with homed() as bench:
        with pytest.raises(ZeroDivisionError):
            await bench.controller.follow(PATH, on_via=fail)
        assert still_moving(bench) == 0.0
        assert bench.controller.state.mode is Mode.IDLE


async def test_motion_without_a_listener_waits_only_for_its_end() -> None:
    async with homed() as bench:
        begun = now()
        seen = len(bench.sent)
        await bench.controller.follow(PATH)
        assert now() > begun
        assert commands_in(bytes(bench.sent[seen:])).count("QR") <= 3


async def test_paused_motion_does_not_resume_when_its_host_returns() -> None:
    """Without a guard the sequence still stands in the controller, paused: no load may let it go on (VR)."""
    async with homed(parse({"safety": {"guard_time": 0.0}}), live=True) as bench:
        motion = asyncio.create_task(bench.controller.move(Joints(1.2, 1.0, 1.8)))
        await elapse(6.0)
        await bench.controller.pause()
        await elapse(2.0)
        stands = places(bench)
        bench.virtual.cut()
        await asyncio.wait({motion})
        assert isinstance(motion.exception(), LinkLost)
        await elapse(5.0)
        assert still_moving(bench) == float("inf")
        with pytest.raises(Busy):
            await bench.controller.recover()
        await bench.controller.stop()
        await elapse(1.0)
        await bench.controller.recover()
        assert places(bench) == pytest.approx(stands, abs=1e-4)
        await bench.controller.move(HERE)
        assert kinds(bench)[-1] is MotionEnded


async def test_homing_does_not_resume_old_motion_in_the_controller() -> None:
    async with homed() as bench:
        stands = places(bench)
        sequence = ["CS S", "VR 0", "VA 10240", "VD 10240", "LM BC", "LI ,90000,-90000", "LE", "BGS"]
        await bench.controller._monitor.link.driver.batch(sequence)
        with pytest.raises(Busy):
            await bench.controller.home()
        assert places(bench) == stands
        assert "VR 1" not in commands_in(bytes(bench.sent))
