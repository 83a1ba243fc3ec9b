"""Zones in the controller: changed at rest only, kept through homing, and no way around them."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.config.files import parse
from maya_un.errors import Busy, MayaError, PathRefused, Unreachable
from maya_un.events import ZonesChanged
from maya_un.kinematics import Box, HalfSpace
from maya_un.testing import rig
from maya_un.values import Joints, Mode, Point
from tests.unit.controller.bench import FAR, HERE, homed, kinds
from tests.virtual_time import elapse

WALL = HalfSpace("wall", Point(0.65, 0.0, 0.0), Point(-1.0, 0.0, 0.0))
"""All beyond x = 0.6, with its margin; `HERE` has x = 0.43, `FAR` 0.69."""


def around(place: Point, half: float) -> Box:
    low, high = (Point(*(coordinate + way for coordinate in place)) for way in (-half, half))
    return Box("cage", low, high)


async def test_configured_zones_apply_from_the_start() -> None:
    table = {"name": "wall", "kind": "half_space", "point": [0.65, 0, 0], "normal": [-1, 0, 0]}
    async with homed(parse({"zones": [table]})) as bench:
        assert bench.controller.zones == (WALL,)
        with pytest.raises(Unreachable, match="zone wall"):
            await bench.controller.move(FAR)


async def test_zone_refuses_by_name_and_removal_allows_again() -> None:
    async with homed() as bench:
        controller = bench.controller
        assert controller.preview([HERE, FAR]).end == controller.units.to_joints(controller.units.to_counts(FAR))
        controller.set_zones([WALL])
        sent = len(bench.sent)
        with pytest.raises(Unreachable, match="zone wall"):
            await controller.move(FAR)
        assert len(bench.sent) == sent
        controller.set_zones([])
        await controller.move(FAR)
        assert controller.state.mode is Mode.IDLE


async def test_a_way_through_a_zone_is_refused_though_its_ends_are_good() -> None:
    async with homed() as bench:
        controller = bench.controller
        middle = controller.mechanism.fk(Joints(*((one + other) / 2 for one, other in zip(HERE, FAR, strict=True))))
        controller.set_zones([around(middle, 0.05)])
        assert controller.workspace.contains(HERE)
        assert controller.workspace.contains(FAR)
        with pytest.raises(PathRefused, match="cage"):
            await controller.move(FAR)


async def test_from_within_a_zone_nothing_moves_before_it_is_taken_away() -> None:
    async with homed() as bench:
        controller = bench.controller
        controller.set_zones([around(controller.mechanism.fk(HERE), 0.1)])
        assert controller.state.homed
        for target in (HERE._replace(a=HERE.a + 0.01), FAR):
            with pytest.raises(MayaError, match="zone cage"):
                await controller.move(target)
        with pytest.raises(MayaError, match="zone cage"):
            await controller.jog("b", 0.01)
        controller.set_zones([])
        await controller.move(HERE._replace(a=HERE.a + 0.01))


async def test_they_stay_as_they_are_while_something_moves() -> None:
    async with homed() as bench:
        controller = bench.controller
        moving = asyncio.create_task(controller.move(FAR))
        await elapse(5.0)
        with pytest.raises(Busy, match="move"):
            controller.set_zones([WALL])
        assert controller.zones == ()
        await controller.stop()
        with pytest.raises(MayaError):
            await moving
        controller.set_zones([WALL])
        assert controller.zones == (WALL,)


async def test_homing_measures_strokes_and_leaves_the_zones() -> None:
    async with rig() as bench:
        controller = bench.controller
        controller.set_zones([WALL])
        assert not controller.state.homed
        before = controller.workspace
        await controller.home()
        assert controller.workspace.zones == (WALL,)
        assert controller.workspace != before


async def test_a_mark_is_taken_over_within_a_zone_too() -> None:
    async with homed() as bench:
        controller = bench.controller
        controller.set_zones([around(controller.mechanism.fk(HERE), 0.1)])
        await controller.skip_home()
        assert controller.state.homed
        assert [zone.name for zone in controller.zones] == ["cage"]


async def test_a_change_is_announced() -> None:
    async with homed() as bench:
        seen = len(bench.controller.events)
        bench.controller.set_zones([WALL, around(Point(0.5, 0.5, 0.5), 0.1)])
        assert kinds(bench, seen) == [ZonesChanged]
        assert bench.controller.events.since(seen)[0].detail["names"] == "wall, cage"
