"""The datum that a person gives: slow and bounded motion until a second point confirms it, judged by the mechanics."""

from __future__ import annotations

import json
import shlex
import tomllib
from pathlib import Path
from random import Random
from typing import Any

import pytest

from dmc41x3.loops import run_virtual
from dmc41x3.wire.transport import Transport
from maya_un.axes import AXES
from maya_un.cli.main import main
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.config.model import STATED_WITHIN
from maya_un.controller.controller import GalilController
from maya_un.controller.datum import NUDGE, SPEED, tension_limit
from maya_un.controller.homing import homed_pose
from maya_un.errors import DatumContradicted, DatumNeeded, DatumRefused, InvalidValue, MayaError, NotHomed, Unreachable
from maya_un.machine.truth import StartPose
from maya_un.testing import Rig, rig
from maya_un.values import Joints, Mode
from tests.campaign import Campaign
from tests.conventions.source import ROOT
from tests.machines import keys_of_machine
from tests.system.processes import running

pytestmark = pytest.mark.system

NO_SWITCHES = {"a": {"switches": "none"}, "b": {"switches": "none"}, "c": {"switches": "none"}}
ARRANGEMENTS: tuple[tuple[str, str, str, bool], ...] = (
    ("none", "none", "none", True),
    ("none", "both", "both", True),
    ("both", "maximum", "maximum", True),
    ("minimum", "minimum", "none", True),
    ("both", "both", "both", False),
)
"""Switches of a, b, c, and whether the motors show torque: arrangements that need a person."""

TABLE_TOP = ROOT / "examples" / "machines" / "table-top.toml"

SLACK = 0.06
"""Largest slack that errors of 20 mm in both lines may cause [m]."""

SECOND = Joints(0.20, 1.40, 1.45)
"""A second point of the manual's machine, away from its homed pose in every axis."""


def bare() -> Config:
    """Return the manual's machine without switches."""
    return parse({"axes": NO_SWITCHES})


def stated(truth: StartPose, rng: Random) -> Joints:
    """Return what a person says who measures a pose badly."""
    return Joints(*(q + rng.uniform(-most, most) for q, most in zip(truth, STATED_WITHIN, strict=True)))


def assert_safe(bench: Rig) -> None:
    """Let the mechanics judge the whole time since power-up."""
    record = bench.mechanics.record
    assert record.stall_time == 0.0
    assert record.peak_tension <= 6.0
    assert record.peak_slack <= SLACK


def machine(kind: int, rng: Random) -> dict[str, Any]:
    """Return the keys of the manual's machine, of a drawn one, or of the small one of the examples."""
    if kind == 0:
        return {"axes": {"a": {}, "b": {}, "c": {}}}
    return keys_of_machine(rng) if kind == 1 else tomllib.loads(TABLE_TOP.read_text())


async def _wander(bench: Rig, rng: Random, moves: int) -> int:
    """Request moves to drawn joints, and return the number of those that were carried out."""
    axes, done = bench.controller.config.axes, 0
    for _ in range(moves):
        target = Joints(*(rng.uniform(axes[axis].minimum, axes[axis].maximum) for axis in range(3)))
        try:
            await bench.controller.move(target)
        except MayaError:
            continue
        done += 1
    return done


async def _given_badly(config: Config, rng: Random) -> int:
    start = StartPose(*homed_pose(config))
    async with rig(config, start=start) as bench:
        with pytest.raises(DatumNeeded):
            await bench.controller.home()
        with pytest.raises(NotHomed):
            await bench.controller.move(homed_pose(config))
        await bench.controller.give_datum(stated(start, rng), by="ana")
        done = await _wander(bench, rng, 60)
        assert_safe(bench)
        return done


def test_no_motion_after_an_inaccurate_datum_strains_the_machine(campaign: Campaign) -> None:
    """For each arrangement of switches that needs a person, on machines of several sizes."""
    done = 0
    for case, (a, b, c, torque) in enumerate(ARRANGEMENTS):
        for start in range(campaign.size(ci=3, long=100)):
            rng = campaign.rng(1000 * case + start)
            keys = machine(start % 3, rng)
            for name, fitted in zip("abc", (a, b, c), strict=True):
                keys["axes"][name]["switches"] = fitted
            keys.setdefault("homing", {})["torque_readings"] = torque
            done += run_virtual(_given_badly(parse(keys), rng))
    assert done > 0


async def test_second_point_that_agrees_allows_all_motion() -> None:
    async with rig(bare(), start=StartPose(*homed_pose(bare()))) as bench:
        controller = bench.controller
        await controller.give_datum(homed_pose(bare()), by="ana")
        assert controller.datum is not None
        assert not controller.datum.confirmed
        assert controller.workspace.tension_limit == tension_limit(2.0)
        slow = controller.preview([homed_pose(bare()), SECOND]).duration
        await controller.move(SECOND)
        await controller.confirm_datum(Joints(*bench.mechanics.true_joints()), by="ben")
        assert controller.datum.confirmed
        assert controller.workspace.tension_limit == bare().safety.tension_limit
        fast = controller.preview([SECOND, homed_pose(bare())]).duration
        assert fast < slow * 1.1 * SPEED**0.5  # ramps only: their time grows with the root
        await controller.home()
        assert controller.state.joints == pytest.approx(homed_pose(bare()), abs=1e-3)
        assert [event.kind for event in controller.events.since(0)].count("datum_confirmed") == 1


async def test_second_point_that_differs_makes_the_homing_invalid() -> None:
    async with rig(bare(), start=StartPose(*homed_pose(bare()))) as bench:
        a, b, c = homed_pose(bare())
        await bench.controller.give_datum(Joints(a, b, c), by="ana")
        await bench.controller.move(SECOND)
        a, b, c = SECOND
        with pytest.raises(DatumContradicted) as refusal:
            await bench.controller.confirm_datum(Joints(a, b, c + 0.03), by="ana")
        assert refusal.value.details == {"axis": "c", "distance": "30.0 mm"}
        assert not bench.controller.state.homed
        with pytest.raises(NotHomed):
            await bench.controller.move(SECOND)


async def test_second_point_must_be_another_one() -> None:
    async with rig(bare(), start=StartPose(*homed_pose(bare()))) as bench:
        pose = homed_pose(bare())
        with pytest.raises(NotHomed):
            await bench.controller.confirm_datum(pose, by="ana")
        await bench.controller.give_datum(pose, by="ana")
        await bench.controller.move(pose._replace(a=pose.a + 0.2, b=pose.b - 0.2))
        with pytest.raises(DatumRefused, match="axis c has moved by less"):
            await bench.controller.confirm_datum(pose, by="ana")
        assert bench.controller.state.homed


async def test_pose_near_an_end_or_with_much_tension_is_no_datum() -> None:
    async with rig(bare()) as bench:
        for joints in (Joints(1.0, 0.58, 1.9), Joints(1.0, 1.05, 1.0), Joints(0.0, 1.5, 1.3), Joints(1.0, 0.9, 0.9)):
            with pytest.raises(Unreachable):
                await bench.controller.give_datum(joints, by="ana")
        assert not bench.controller.state.homed
        assert b"DP" not in bench.sent


async def test_unconfirmed_datum_survives_a_restart_as_such() -> None:
    async with rig(bare(), start=StartPose(*homed_pose(bare()))) as bench:
        await bench.controller.give_datum(homed_pose(bare()), by="ana")
        await bench.controller.close()

        async def dial() -> Transport:
            return bench.virtual.loopback()

        later = GalilController(dial, "twin", bare(), live=False)
        try:
            await later.open()
            await later.skip_home()
            assert later.state.homed
            assert later.datum is not None
            assert later.datum.joints == pytest.approx(homed_pose(bare()), abs=1e-3)
            assert not later.datum.confirmed
            assert later.workspace.tension_limit == tension_limit(2.0)
        finally:
            await later.close()


async def test_guarded_moves_bring_a_robot_to_a_known_pose() -> None:
    async with rig(bare(), start=StartPose(1.0, 1.6, 1.5)) as bench:
        for axis, distance in (("a", -0.05), ("b", 0.05), ("c", -0.05)):
            gone = await bench.controller.guarded_move(axis, distance)
            assert gone.distance == pytest.approx(distance, abs=1e-4)
        assert bench.mechanics.true_joints() == pytest.approx((0.95, 1.65, 1.45), abs=1e-3)
        assert not bench.controller.state.homed
        assert_safe(bench)


async def test_the_remedy_of_a_robot_that_is_not_homed_is_the_one_that_works() -> None:
    async with rig(bare()) as bench:
        for refused in (bench.controller.move(SECOND), bench.controller.confirm_datum(SECOND, by="ada")):
            with pytest.raises(NotHomed, match="Run `maya datum` first"):
                await refused
    async with rig(Config()) as bench:
        with pytest.raises(NotHomed, match="Run `maya home` first"):
            await bench.controller.move(SECOND)


@pytest.mark.parametrize("axis", AXES)
async def test_guarded_move_is_short(axis: str) -> None:
    async with rig(bare()) as bench:
        for distance in (1.01 * NUDGE[AXES.index(axis)], float("nan")):
            with pytest.raises(InvalidValue, match="one `maya datum move` is at most 50 mm or 5 degrees long"):
                await bench.controller.guarded_move(axis, distance)
        with pytest.raises(InvalidValue, match="it must not be 0"):
            await bench.controller.guarded_move(axis, 0.0)
        assert b"BG" not in bench.sent


async def test_guarded_move_ends_before_the_lines_are_straight() -> None:
    async with rig(bare(), start=StartPose(1.0, 1.05, 1.05)) as bench:
        ended = [await bench.controller.guarded_move("b", -0.05) for _ in range(4)]
        assert ended[-1].limit == "tension"
        assert bench.mechanics.record.peak_tension < 3.0
        assert bench.mechanics.record.stall_time == 0.0


@pytest.mark.parametrize(("start", "way"), [(0.02, -0.05), (Config().axes.a.maximum - 0.02, 0.05)])
async def test_guarded_move_ends_at_a_switch_and_leaves_it_again(start: float, way: float) -> None:
    lines = {"b": {"switches": "none"}, "c": {"switches": "none"}}
    async with rig(parse({"axes": lines}), start=StartPose(start, 1.5, 1.3), live=True) as bench:
        met = await bench.controller.guarded_move("a", way)
        assert abs(met.distance) < abs(way)
        assert (met.limit, bool(met.reason)) == ("switch", True)
        there = bench.mechanics.true_joints()
        again = await bench.controller.guarded_move("a", way)
        assert (again.distance, again.limit) == (0.0, "switch")
        assert bench.mechanics.true_joints() == pytest.approx(there, abs=1e-5)
        assert bench.controller.state.mode is Mode.NOT_HOMED
        back = await bench.controller.guarded_move("a", -way)
        assert (back.distance, back.limit) == (pytest.approx(-way, abs=1e-3), "")
        assert_safe(bench)


async def test_homed_robot_makes_no_guarded_moves() -> None:
    async with rig(bare(), start=StartPose(*homed_pose(bare()))) as bench:
        await bench.controller.give_datum(homed_pose(bare()), by="ana")
        with pytest.raises(DatumRefused):
            await bench.controller.guarded_move("a", 0.05)


TOML = "".join(f'[axes.{axis}]\nswitches = "none"\n' for axis in "abc")


def test_person_homes_a_robot_without_switches_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def said(line: str, code: int = 0) -> str:
        ended = main(shlex.split(line))
        out, err = capsys.readouterr()
        assert ended == code, out + err
        return out + err

    (tmp_path / "maya.toml").write_text(TOML)
    with running(f"up --port 0 --speed 100 --config {tmp_path / 'maya.toml'}") as up:
        up.until("maya home")
        assert "error 2113" in said("home", code=1)
        assert "Moved b by 20.0 mm." in said("datum move b 20mm")
        assert "Moved b by -20.0 mm." in said("datum move b -20mm")
        assert "at most 50 mm" in said("datum move b 60mm", code=2)
        assert json.loads(said("datum --json"))["given"] is None
        said("datum give")
        assert "datum not confirmed" in said("status")
        said("move 20deg 1400mm 1450mm")
        said("datum confirm 20deg 1410mm 1445mm")
        assert json.loads(said("datum --json"))["confirmed"] is True
        assert "datum not confirmed" not in said("status")
        said("home")
        told = said("logs")
        assert "local gave the datum" in told
        assert "local confirmed the datum" in told
