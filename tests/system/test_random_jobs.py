"""Random jobs on random machines, every motion judged by formulas and brute force that the planner does not know.

An accepted motion never leaves the workspace or a zone's margin on the twin. It keeps to the requested path and to the
speeds of the axes, and takes the predicted time. A motion that is stopped, slowed or paused keeps to its path as well.
The judge must refuse every refused motion too: a disagreement is a failure, and places within the width of doubt are
counted.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Sequence
from math import cos, sin
from random import Random
from typing import NamedTuple

import numpy as np
import pytest

from dmc41x3.loops import run_virtual
from maya_un.controller.seek import SETTLE
from maya_un.errors import CannotPause, MayaError, PathRefused, Stopped, TrajectoryRefused, Unreachable
from maya_un.motion import Blend, Path
from maya_un.motion import Space as Straight
from maya_un.robot.primitives import Primitive
from maya_un.robot.primitives.approach import Approach
from maya_un.robot.primitives.gripper import Gripper
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.primitives.place import Place
from maya_un.robot.robot import MayaRobot
from maya_un.testing import Rig
from maya_un.values import Joints, Mode, Point
from tests.campaign import Campaign
from tests.judge.mechanism import Floats, joints_at, places, section, to_cylinder
from tests.judge.paths import Cut, Opinion, Space, Way, deviations, drawn, judged
from tests.judge.trajectory import PARTS, Trajectory
from tests.machines import Machine, anywhere, drawn_machine, edge_place, homed
from tests.virtual_time import elapse

SHARDS = 4
REQUESTS = 4
LAG = 0.1
"""The axes are at rest at the latest so long after what they follow is [s]."""

LONGEST_PAUSE = 2.0
"""A robot is paused so long [s], or longer where it is not resumed at once."""

CHORDS = 5e-5
"""A curved way is driven in chords that are so much off it [rad, m]."""

SPACES: tuple[Space, ...] = ("joint", "joint", "cartesian", "cylindrical")

OFF_THE_WAY = 5e-4
"""Allowed distance of the gripper from a curved path [m] ..."""

FLAT = 0.1
"""... and in proportion farther where the lines meet less deep than this share of the width: there they lift most."""


class Trial(NamedTuple):
    """A robot on its twin, what is known of it, and the source of all chance."""

    bench: Rig
    machine: Machine
    rng: Random
    tally: Counter[str]

    @property
    def here(self) -> Joints:
        """Position of the robot at rest: its latest state may have been read while it was stopping."""
        self.bench.virtual.sync()
        return self.machine.whole(self.bench.mechanics.true_joints())

    def since(self, mark: float) -> Trajectory:
        """Return what the mechanics did since time `mark` [s]."""
        self.bench.virtual.sync()
        return Trajectory.of(self.bench.mechanics.record.trace, mark)

    def now(self) -> float:
        """Bring the mechanics to the present and return their time [s]."""
        self.bench.virtual.sync()
        return self.bench.mechanics.now


@pytest.mark.parametrize("shard", range(SHARDS))
def test_motions_keep_to_their_word(shard: int, campaign: Campaign) -> None:
    tally = Counter[str]()
    for case in range(campaign.size(ci=12, long=250)):
        run_virtual(_job(campaign.rng(case), tally))
    assert tally["done"] > 0.2 * tally["requests"]
    assert tally["refused"] > 0.05 * tally["requests"]
    print(dict(sorted(tally.items())))


async def _job(rng: Random, tally: Counter[str]) -> None:
    machine, place = drawn_machine(rng)
    async with homed(machine, place) as bench:
        trial = Trial(bench, machine, rng, tally)
        robot = MayaRobot(bench.controller, machine.config)
        for _ in range(rng.randint(1, REQUESTS)):
            tally["requests"] += 1
            await elapse(LAG)
            if rng.random() < 0.25:
                await _skill(trial, robot)
            else:
                await _way(trial)
            assert bench.controller.state.mode is Mode.IDLE
            assert bench.mechanics.record.stall_time == 0.0


def drawn_way(trial: Trial) -> Way:
    """Return a way from where the robot is to one to three places, some of them on the edge or outside."""
    rng, machine = trial.rng, trial.machine
    waypoints = [trial.here]
    for _ in range(rng.choice((1, 1, 2, 3))):
        inside = machine.drawn_place(rng)
        assert inside is not None
        match rng.choice(("inside", "inside", "inside", "inside", "edge", "anywhere")):
            case "edge":
                waypoints.append(edge_place(rng, machine, inside))
            case "anywhere":
                waypoints.append(anywhere(rng, machine))
            case _:
                waypoints.append(inside)
    space = rng.choice(SPACES)
    return Way(space, _coordinates(trial, space, waypoints), tuple(_drawn_cut(rng) for _ in waypoints[2:]))


def _drawn_cut(rng: Random) -> Cut:
    match rng.choice(("sharp", "even", "any")):
        case "sharp":
            return Cut(0.0, 0.0)
        case "even":
            length = rng.uniform(0.005, 0.3)
            return Cut(length, length)
        case _:
            return Cut(rng.uniform(0.005, 0.3), rng.uniform(0.005, 0.3), rng.uniform(0.1, 1.0), rng.uniform(0.1, 1.0))


def _coordinates(trial: Trial, space: Space, waypoints: Sequence[Joints]) -> tuple[tuple[float, float, float], ...]:
    joints = np.array(waypoints)
    if space != "joint":
        joints = places(trial.machine.frame, joints)
    if space == "cylindrical":
        joints = to_cylinder(joints)
    return tuple((x, y, z) for x, y, z in joints.tolist())


async def _way(trial: Trial) -> None:
    way, speed = drawn_way(trial), trial.rng.choice((1.0, trial.rng.uniform(0.05, 1.0)))
    controller = trial.bench.controller
    path = Path(Straight(way.space), way.waypoints, tuple(Blend(*cut) for cut in way.cuts))
    try:
        preview = controller.preview(path, speed=speed)
    except TrajectoryRefused:
        trial.tally["too long"] += 1
        return
    except (Unreachable, PathRefused) as refusal:
        _agree_that_it_is_outside(trial, way, refusal)
        with pytest.raises(type(refusal)):
            await controller.follow(path, speed=speed)
        return
    joints = drawn(trial.machine.frame, way, 2_000)
    verdict = judged(trial.machine.frame, joints, trial.machine.zones, _doubt(trial, way, joints))
    assert verdict.opinion is not Opinion.OUTSIDE, f"{verdict}\n{way}\n{trial.machine.config!r}"
    mark, began = trial.now(), asyncio.get_running_loop().time()
    ended = await _disturbed(trial, asyncio.create_task(controller.follow(path, speed=speed)), preview.duration)
    trajectory = trial.since(mark)
    _judge_safety(trial, trajectory)
    _judge_closeness(trial, way, trajectory)
    trial.tally[ended] += 1
    if ended == "done":
        assert asyncio.get_running_loop().time() - began == pytest.approx(preview.duration, rel=1e-3, abs=1e-9)
        _judge_pace(trial, way, trajectory, preview.duration)


def _agree_that_it_is_outside(trial: Trial, way: Way, refusal: MayaError) -> None:
    joints = drawn(trial.machine.frame, way)
    verdict = judged(trial.machine.frame, joints, trial.machine.zones, _doubt(trial, way, joints))
    trial.tally["refused"] += 1
    trial.tally["undecided"] += verdict.opinion is Opinion.UNDECIDED
    assert verdict.opinion is not Opinion.INSIDE, f"{refusal}\n{verdict}\n{way}\n{trial.machine.config!r}"


async def _disturbed(trial: Trial, motion: asyncio.Task[None], duration: float) -> str:
    """Let a motion end by itself, or stop it, or change its pace; return "done", "stopped" or "paced"."""
    controller, rng = trial.bench.controller, trial.rng
    kind = rng.choice(("done", "done", "stopped", "paced"))
    if kind == "stopped":
        await asyncio.wait({motion}, timeout=rng.uniform(0.0, duration))
        report = await controller.stop()
        begun = asyncio.get_running_loop().time()
        await asyncio.wait({motion})
        assert asyncio.get_running_loop().time() - begun <= report.duration + 0.2
    elif kind == "paced":
        await _pace(trial, motion, duration)
    await asyncio.wait({motion})
    error = motion.exception()
    assert error is None or isinstance(error, Stopped), error
    return "stopped" if error is not None else kind if kind != "stopped" else "done"


async def _pace(trial: Trial, motion: asyncio.Task[None], duration: float) -> None:
    """Slow, quicken, pause and resume at random instants; in the end everything is as it was."""
    controller, rng = trial.bench.controller, trial.rng
    for _ in range(rng.randint(1, 6)):
        held = controller.state.mode is Mode.PAUSED
        await asyncio.wait({motion}, timeout=rng.uniform(0.0, LONGEST_PAUSE if held else 0.5 * duration))
        if motion.done():
            break
        if rng.random() < 0.5:
            await controller.override(rng.uniform(0.1, 1.0))
        elif held:
            await controller.resume()
        else:
            try:
                await controller.pause()
            except CannotPause:
                assert motion.done()
    if controller.state.mode is Mode.PAUSED:
        await controller.resume()
    await controller.override(1.0)


def _edge(trial: Trial, joints: Floats, off: float = 0.0) -> float:
    """Return by how much a place on the very edge may be outside once it is rounded to whole counts [m].

    Allowed error if every axis is `off` [rad, m] its path. A small change of nearly straight lines lowers or lifts
    the gripper a lot.
    """
    scale, frame = trial.bench.controller.units.per_unit, trial.machine.frame
    _, h = section(frame, joints)
    steepness = 2.0 + 4.0 * frame.width / max(1e-3, float(h.min()))
    return steepness * (1.0 / scale[1] + off) + frame.length * (1.0 / scale[0] + off)


def _doubt(trial: Trial, way: Way, joints: Floats) -> float:
    """Return how near to a limit the judge and the planner may differ [m]: chords are not the curve."""
    return _edge(trial, joints, CHORDS) if _curved(way) else max(1e-6, _edge(trial, joints))


def _curved(way: Way) -> bool:
    return way.space != "joint" or any(cut.before for cut in way.cuts)


def _judge_safety(trial: Trial, trajectory: Trajectory) -> None:
    machine = trial.machine
    least = trajectory.least(machine.frame, machine.zones)
    edge = _edge(trial, trajectory.joints)
    broken = {name: margin for name, margin in least.items() if margin < -edge}
    assert not broken, f"{broken}\n{machine.config!r}"
    over = trajectory.speeds() / machine.rates.speed - 1.0
    assert over.max() < 1e-4, f"faster than the axes may: {over}\n{machine.config!r}"


def _judge_closeness(trial: Trial, way: Way, trajectory: Trajectory) -> None:
    frame, scale = trial.machine.frame, trial.bench.controller.units.per_unit
    if not _curved(way):
        weights = np.array((frame.length, 1.0, 1.0))
        off = deviations(trajectory.joints * weights, np.array(way.waypoints) * weights).max()
        assert off <= frame.length / scale[0] + 2.0 / scale[1], off
    else:
        off = deviations(places(frame, trajectory.joints), places(frame, drawn(frame, way, 5_000)))
        _, h = section(frame, trajectory.joints)
        allowed = OFF_THE_WAY * np.maximum(1.0, FLAT * frame.width / np.maximum(h, 1e-3))
        assert (off <= allowed).all(), f"{off.max()}\n{way}\n{trial.machine.config!r}"
        trial.tally["worst µm"] = max(trial.tally["worst µm"], round(float(off.max()) * 1e6))


def _judge_pace(trial: Trial, way: Way, trajectory: Trajectory, duration: float) -> None:
    """An undisturbed motion ends at its target, at the predicted time, and no axis accelerates too fast."""
    rates = trial.machine.rates
    begun, over = trajectory.moving()
    if over > begun:
        assert over - begun == pytest.approx(duration - SETTLE, rel=1e-3, abs=2e-3)
    scale = np.array(trial.bench.controller.units.per_unit)
    end = drawn(trial.machine.frame, way, 2)[-1]
    assert (np.abs(trajectory.end - end) * scale).max() <= 0.51
    for axis in range(3):
        slowest = min(rates.acceleration[axis], rates.deceleration[axis])
        fastest = max(rates.acceleration[axis], rates.deceleration[axis])
        window = rates.speed[axis] / slowest
        rounding = 2.0 / scale[axis] * PARTS / window**2
        mean = trajectory.mean_accelerations(window)[axis]
        assert mean <= 1.1 * fastest + rounding, f"axis {axis}: {mean / fastest}\n{trial.machine.config!r}\n{way}"


def drawn_target(trial: Trial) -> Point:
    """Return a place before the boom that the gripper may or may not reach."""
    rng, frame = trial.rng, trial.machine.frame
    a, d = rng.uniform(*frame.strokes[0]), rng.uniform(frame.delta, frame.length)
    return Point(d * sin(a), d * cos(a), rng.uniform(0.1, 0.6) * frame.top)


async def _skill(trial: Trial, robot: MayaRobot) -> None:
    """Approach, pick or place somewhere, as the gripper allows."""
    primitive: Primitive = trial.rng.choice((Approach, Pick, Place))(drawn_target(trial))
    closed = isinstance(primitive, Place)
    if trial.bench.controller.state.gripper_closed is not closed:
        await robot.run(Gripper(open=not closed))
    try:
        duration = robot.preview(primitive, robot.pose).duration
    except Unreachable as refusal:
        _agree_that_a_target_is_outside(trial, primitive, refusal)
        return
    except PathRefused:
        trial.tally["no way"] += 1
        return
    assert duration is not None
    mark, began = trial.now(), asyncio.get_running_loop().time()
    ended = await _disturbed(trial, asyncio.create_task(robot.run(primitive)), duration)
    _judge_safety(trial, trial.since(mark))
    trial.tally[ended] += 1
    if ended == "done":
        assert asyncio.get_running_loop().time() - began == pytest.approx(duration, rel=1e-3)


def _agree_that_a_target_is_outside(trial: Trial, primitive: Primitive, refusal: MayaError) -> None:
    assert isinstance(primitive, Approach | Pick | Place)
    x, y, z = primitive.target
    above = (x, y, z + trial.machine.config.cell.clearance)
    points = [above] if isinstance(primitive, Approach) else [(x, y, z), above]
    opinions = [_opinion(trial, point) for point in points]
    trial.tally["refused"] += 1
    trial.tally["undecided"] += Opinion.OUTSIDE not in opinions
    assert opinions != [Opinion.INSIDE] * len(points), f"{refusal}\n{trial.machine.config!r}"


def _opinion(trial: Trial, point: Sequence[float]) -> Opinion:
    frame = trial.machine.frame
    if point[2] >= frame.top:
        return Opinion.OUTSIDE
    return judged(frame, joints_at(frame, np.array([point])), trial.machine.zones).opinion
