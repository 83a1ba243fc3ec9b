"""Length of a jog: by hand where the limit is plain, by walking along the line where it is not, and on the twin."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from math import cos, inf, nan, radians, sin

import pytest

from maya_un.axes import JOG_AXES
from maya_un.config import Config
from maya_un.controller.planner import MARGIN, TOLERANCE, Jogging, JogLine, Planner
from maya_un.errors import InvalidValue, MayaError, PathRefused, Stopped, UnknownName, Unreachable
from maya_un.kinematics import Mechanism, Workspace
from maya_un.kinematics.zones import Box
from maya_un.schema.robot import Jogged
from maya_un.values import JogDirection, Joints, Mode, Point
from tests.campaign import Campaign
from tests.unit.controller.bench import FAR, HERE, commands_in, homed
from tests.virtual_time import elapse

CONFIG = Config()
MECHANISM = Mechanism.of(CONFIG)
WORKSPACE = Workspace.of(CONFIG)
PLANNER = Planner(CONFIG, MECHANISM)
JOGGING = Jogging(PLANNER, MECHANISM)

CLOSE = MARGIN + TOLERANCE + 1e-6
"""A jog that a limit ends comes to rest at most this far before it."""


def jogged(axis: JogDirection, way: float, here: Joints = HERE, workspace: Workspace = WORKSPACE) -> Jogged:
    return JOGGING.within(workspace, axis, here, way)


@pytest.mark.parametrize("axis", JOG_AXES)
@pytest.mark.parametrize("way", [0.05, -0.05, 0.0])
def test_possible_jog_is_done_in_full(axis: str, way: float) -> None:
    assert jogged(axis, way) == Jogged(axis, way)


@pytest.mark.parametrize("way", [0.05, 9.0, -9.0])
@pytest.mark.parametrize("axis", ["x", "y", "z", "r"])
def test_jog_along_a_vector_goes_as_far_as_the_one_along_its_axis(axis: str, way: float) -> None:
    by_name = jogged(axis, way)
    x, y, z = JogLine.along(axis, HERE, MECHANISM).direction
    assert jogged((x, y, z), way) == replace(by_name, axis="")


@pytest.mark.parametrize(
    ("axis", "way", "end", "limit"),
    [
        ("a", 9.0, radians(120.0) - HERE.a, "boom"),
        ("a", -9.0, -HERE.a, "boom"),
        ("b", 9.0, 2.260 - HERE.b, "line_b"),
        ("c", 9.0, 2.300 - HERE.c, "line_c"),
        ("c", -9.0, 0.565 - HERE.c, "line_c"),
        # d from 1.44 m to the inner anchor at 0.30 and to the outer one at 2.30.
        ("r", -9.0, -1.14, "inner"),
        ("r", 1e4, 0.86, "outer"),
    ],
)
def test_it_ends_a_little_before_the_limit(axis: str, way: float, end: float, limit: str) -> None:
    found = jogged(axis, way)
    assert (found.limit, found.reason != "") == (limit, True)
    assert 0.0 < abs(end) - abs(found.distance) <= CLOSE
    assert found.distance * way > 0.0


def test_jog_along_x_ends_where_the_boom_ends() -> None:
    x = MECHANISM.fk(HERE).x
    found = jogged("x", -2.0)
    assert found.limit == "boom"
    assert 0.0 < x + found.distance <= CLOSE


@pytest.mark.parametrize(("axis", "way", "place"), [("x", 0.2, 0), ("y", -0.2, 1), ("z", 0.2, 2)])
def test_an_axis_of_space_moves_its_coordinate_only(axis: str, way: float, place: int) -> None:
    start, end = MECHANISM.fk(HERE), JogLine.along(axis, HERE, MECHANISM).at(way)
    assert isinstance(end, Point)
    assert [there - here for here, there in zip(start, end, strict=True)] == pytest.approx(
        [way if i == place else 0.0 for i in range(3)]
    )


def test_r_goes_outward_along_the_boom() -> None:
    start, end = MECHANISM.fk(HERE), JogLine.along("r", HERE, MECHANISM).at(0.1)
    assert end == pytest.approx((start.x + 0.1 * sin(HERE.a), start.y + 0.1 * cos(HERE.a), start.z))


def test_prediction_agrees_with_walking_along_the_line(campaign: Campaign) -> None:
    """Steps of a tenth of a millimetre see where a line leaves a workspace without zones."""
    for case in range(campaign.size(ci=12, long=300)):
        rng = campaign.rng(case)
        here = Joints(rng.uniform(0.1, 2.0), rng.uniform(1.2, 1.9), rng.uniform(1.2, 1.9))
        axis, sign = rng.choice(JOG_AXES), rng.choice((-1.0, 1.0))
        line = JogLine.along(axis, here, MECHANISM)
        walked = 0.0
        while WORKSPACE.why_not(line.at(sign * (walked + 1e-4))) is None:
            walked += 1e-4
        found = jogged(axis, sign * 9.0, here)
        assert walked - CLOSE <= abs(found.distance) <= walked + TOLERANCE, f"case {case}: {axis} from {here}"
        PLANNER.prove(WORKSPACE, line.path(found.distance, MECHANISM))


def test_a_zone_on_the_way_ends_it() -> None:
    x, y, z = MECHANISM.fk(HERE)
    wall = Box("wall", Point(x + 0.3, y - 0.5, 0.0), Point(x + 0.301, y + 0.5, z + 0.2), margin=0.01, lines=False)
    found = jogged("x", 9.0, workspace=WORKSPACE.with_zones((wall,)))
    assert (found.limit, "wall" in found.reason) == ("zone", True)
    assert 0.29 - found.distance == pytest.approx(MARGIN + TOLERANCE, abs=1.1 * TOLERANCE)


def test_at_the_border_no_path_is_left() -> None:
    here = HERE._replace(b=2.260)
    assert jogged("b", 0.1, here).distance == 0.0
    assert jogged("b", -0.1, here) == Jogged("b", -0.1)
    assert str(jogged("a", -0.1, HERE._replace(a=0.0)).distance) == "0.0"


def test_from_outside_the_workspace_nothing_is_allowed() -> None:
    with pytest.raises(Unreachable):
        jogged("b", -0.1, HERE._replace(b=2.28))


@pytest.mark.parametrize(
    ("axis", "way", "error"),
    [("d", 0.1, UnknownName), ("b", nan, InvalidValue), ("x", -inf, InvalidValue), ("c", 1e308, InvalidValue)],
)
def test_invalid_jog_is_refused(axis: str, way: float, error: type[MayaError]) -> None:
    with pytest.raises(error):
        jogged(axis, way)


@pytest.mark.parametrize("axis", ["x", "y", "z", "r"])
async def test_the_gripper_goes_straight_on_the_twin(axis: str) -> None:
    async with homed() as bench:
        start = MECHANISM.fk(HERE)
        direction = JogLine.along(axis, HERE, MECHANISM).direction
        jog = asyncio.create_task(bench.controller.jog(axis, -0.2))
        while not jog.done():
            await elapse(0.25)
            point = MECHANISM.fk(Joints(*bench.mechanics.true_joints()))
            way = [there - here for here, there in zip(start, point, strict=True)]
            along = sum(one * share for one, share in zip(way, direction, strict=True))
            aside = [one - along * share for one, share in zip(way, direction, strict=True)]
            assert max(map(abs, aside)) < 1e-3  # the lag of the axes while they move, and the boom's counts
        assert await jog == Jogged(axis, -0.2)


async def test_clipped_jog_rests_before_the_border_and_names_the_limit() -> None:
    async with homed() as bench:
        with pytest.raises((Unreachable, PathRefused)):
            await bench.controller.jog("r", 2.0)
        found = await bench.controller.jog("r", 2.0, clip=True)
        assert found.limit == "outer"
        point = bench.controller.state.point
        assert point is not None
        gone = ((point.x - MECHANISM.fk(HERE).x) ** 2 + (point.y - MECHANISM.fk(HERE).y) ** 2) ** 0.5
        assert gone == pytest.approx(found.distance, abs=2e-4)
        assert bench.controller.state.mode is Mode.IDLE
        seen = len(bench.sent)
        assert (await bench.controller.jog("r", 2.0, clip=True)).distance == pytest.approx(0.0, abs=2 * TOLERANCE)
        assert "BGS" not in commands_in(bytes(bench.sent[seen:]))
        assert await bench.controller.jog("r", -0.1, clip=True) == replace(found, distance=-0.1, limit="", reason="")


async def test_a_jog_can_be_stopped_and_paused_as_all_motion() -> None:
    async with homed() as bench:
        jog = asyncio.create_task(bench.controller.jog("z", -0.3))
        await elapse(1.0)
        await bench.controller.pause()
        await elapse(60.0)
        assert not jog.done()
        await bench.controller.resume()
        await elapse(1.0)
        await bench.controller.stop()
        with pytest.raises(Stopped):
            await jog
        await bench.controller.move(FAR)
