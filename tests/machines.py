"""Machines drawn at random: configuration, the twin's own truth, and what the judge knows of both."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, replace
from math import cos, pi, sin
from random import Random
from typing import Any

import numpy as np

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.wire.server import VirtualController
from maya_un.assembly.controller import machine_of
from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.config.model import AnyZone, BoxConfig, CylinderConfig
from maya_un.controller.monitor import OFF_SWITCH
from maya_un.errors import InvalidConfig
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.testing import Rig, rig
from maya_un.values import Joints
from tests.homing_mark import take_over
from tests.judge.mechanism import Frame
from tests.judge.paths import Opinion, judged
from tests.judge.zones import Behind, Block, Column, Solid
from tests.lower_bound import Rates

Triple = tuple[float, float, float]

FURTHER = 0.01
"""The lines' long ends are so much further away than configured [m]."""

_QUANTUM = 1024
_TRIES = 1_000


@dataclass(frozen=True, slots=True)
class Machine:
    """A configuration, and the same facts for the twin and for the judge."""

    config: Config
    truth: TrueConstants
    frame: Frame
    zones: tuple[Solid, ...]
    rates: Rates

    @classmethod
    def of(cls, config: Config) -> Machine:
        """Return the machine of a configuration; the long ends of its lines are further away than configured.

        So the strokes of the lines are those configured; the boom's ends short of its switch.
        """
        geometry, axes = config.geometry, (config.axes.a, config.axes.b, config.axes.c)
        a, b, c = ((axis.minimum, axis.maximum) for axis in axes)
        truth = replace(machine_of(config), switches=(a, _beyond(b), _beyond(c)))
        turn = a[0], a[1] - OFF_SWITCH[0]
        return cls(
            config,
            truth,
            Frame(
                geometry.height,
                geometry.length,
                geometry.delta,
                geometry.gripper_height,
                (turn, b, c),
                config.safety.tension_limit,
            ),
            tuple(map(_solid, config.zones)),
            _rates(config),
        )

    def whole(self, joints: Triple) -> Joints:
        """Return the joints at the nearest whole counts."""
        units = Units.of(self.config)
        return units.to_joints(units.to_counts(Joints(*joints)))

    def inside(self, joints: Triple, doubt: float = 1e-3) -> bool:
        """Whether the judge finds a place clear of every limit and zone by `doubt` [m]."""
        return judged(self.frame, np.array([joints]), self.zones, doubt).opinion is Opinion.INSIDE

    def drawn_place(self, rng: Random, doubt: float = 1e-3) -> Joints | None:
        """Return a place inside, None where none is found."""
        for _ in range(_TRIES):
            joints = _anywhere(rng, self.frame)
            if self.inside(joints, doubt):
                return self.whole(joints)
        return None


def _beyond(ends: tuple[float, float]) -> tuple[float, float]:
    return ends[0], ends[1] + FURTHER


def _rates(config: Config) -> Rates:
    scale = Units.of(config).per_unit
    axes = (config.axes.a, config.axes.b, config.axes.c)

    def three(registers: tuple[int, ...]) -> Triple:
        a, b, c = (register / unit for register, unit in zip(registers, scale, strict=True))
        return a, b, c

    return Rates(
        three(tuple(axis.speed_counts for axis in axes)),
        three(tuple(axis.acceleration_counts for axis in axes)),
        three(tuple(axis.deceleration_counts for axis in axes)),
    )


def _solid(zone: AnyZone) -> Solid:
    if isinstance(zone, BoxConfig):
        return Block(zone.name, zone.margin, zone.lines, zone.low, zone.high)
    if isinstance(zone, CylinderConfig):
        return Column(zone.name, zone.margin, zone.lines, (zone.x, zone.y), zone.radius, zone.low, zone.high)
    return Behind(zone.name, zone.margin, zone.lines, zone.point, zone.normal)


def _anywhere(rng: Random, frame: Frame) -> Triple:
    a, b, c = (rng.uniform(*ends) for ends in frame.strokes)
    return a, b, c


def edge_place(rng: Random, machine: Machine, inside: Joints) -> Joints:
    """Return a place within a few counts of the nearest limit between `inside` and a place anywhere."""
    there = _anywhere(rng, machine.frame)
    low, high = 0.0, 1.0
    for _ in range(22):
        share = 0.5 * (low + high)
        if machine.inside(_between(inside, there, share), 0.0):
            low = share
        else:
            high = share
    return machine.whole(_between(inside, there, max(0.0, low + rng.uniform(-2e-5, 1e-6))))


def anywhere(rng: Random, machine: Machine) -> Joints:
    """Return joints in the strokes, reachable or not."""
    return machine.whole(_anywhere(rng, machine.frame))


def _between(one: Triple, two: Triple, share: float) -> Triple:
    a, b, c = (here + share * (there - here) for here, there in zip(one, two, strict=True))
    return a, b, c


def drawn_machine(rng: Random) -> tuple[Machine, Joints]:
    """Return a machine and a place inside its workspace: the manual's or one of other sizes, with zones or without."""
    while True:
        keys = {} if rng.random() < 0.4 else keys_of_machine(rng)
        bare = Machine.of(parse(keys))
        start = bare.drawn_place(rng)
        if start is None:
            continue
        zones = [_zone(rng, bare, number) for number in range(rng.choice((0, 0, 1, 2, 3)))]
        machine = Machine.of(parse(keys | {"zones": zones}))
        place = start if machine.inside(start) else machine.drawn_place(rng)
        if place is not None:
            return machine, place


def keys_of_machine(rng: Random) -> dict[str, Any]:
    """Return the configuration of a machine of other sizes, speeds and limits that can be homed."""
    while True:
        keys = _drawn_keys(rng)
        with suppress(InvalidConfig):
            parse(keys)
            return keys


def _drawn_keys(rng: Random) -> dict[str, Any]:
    width = rng.uniform(1.2, 2.8)
    delta = rng.uniform(0.15, 0.6)
    per_metre, per_degree = 10.0 ** rng.uniform(5.3, 6.3), 10.0 ** rng.uniform(2.2, 3.3)
    turn = rng.uniform(0.0, 0.5)
    lines = [(width * rng.uniform(0.2, 0.4), width * rng.uniform(1.0, 1.25)) for _ in "bc"]
    return {
        "geometry": {
            "height": width * rng.uniform(1.0, 1.3),
            "length": delta + width,
            "delta": delta,
            "gripper_height": rng.uniform(0.1, 0.3),
        },
        "scale": {"pulses_per_metre": per_metre, "pulses_per_degree": per_degree},
        "axes": {
            "a": _axis(rng, (turn, turn + rng.uniform(1.0, 2.6)), per_degree * 180.0 / pi),
            "b": _axis(rng, lines[0], per_metre),
            "c": _axis(rng, lines[1], per_metre),
        },
        "safety": {"tension_limit": rng.uniform(1.6, 8.0)},
        "cell": {"grasp_height": width * 0.25, "clearance": width * rng.uniform(0.03, 0.08)},
    }


def _axis(rng: Random, ends: tuple[float, float], per_unit: float) -> dict[str, object]:
    speed = max(100, round(per_unit * 10.0 ** rng.uniform(-1.7, -0.5)) // 2 * 2)
    rates = [max(1, round(speed * rng.uniform(0.1, 2.0) / _QUANTUM)) * _QUANTUM for _ in "ud"]
    stop = max(rates) * rng.choice((1, 3, 10))
    return {
        "minimum": ends[0],
        "maximum": ends[1],
        "speed_counts": speed,
        "acceleration_counts": rates[0],
        "deceleration_counts": rates[1],
        "stop_deceleration_counts": stop,
        "limit_deceleration_counts": stop,
        "error_limit_counts": max(1_000, speed // 5),
    }


def _zone(rng: Random, machine: Machine, number: int) -> dict[str, object]:
    """Return a zone somewhere about the workspace, as the configuration has it."""
    frame = machine.frame
    a = rng.uniform(*frame.strokes[0])
    d, z = rng.uniform(frame.delta, frame.length), rng.uniform(0.0, frame.top)
    x, y = d * sin(a), d * cos(a)
    common: dict[str, object] = {
        "name": f"zone{number}",
        "margin": rng.choice((0.0, 0.02, 0.05)),
        "lines": rng.random() < 0.7,
    }
    size = [rng.uniform(0.05, 0.3) for _ in range(3)]
    match rng.choice(("box", "cylinder", "half_space")):
        case "box":
            low, high = ([place + sign * half for place, half in zip((x, y, z), size, strict=True)] for sign in (-1, 1))
            return common | {"kind": "box", "low": low, "high": high}
        case "cylinder":
            return common | {
                "kind": "cylinder",
                "x": x,
                "y": y,
                "radius": size[0],
                "low": z - size[1],
                "high": z + size[2],
            }
        case _:
            tilt = rng.uniform(0.0, 2.0 * pi)
            point = [(frame.length + size[0]) * sin(a), (frame.length + size[0]) * cos(a), z]
            normal = [-sin(a) + 0.3 * cos(tilt), -cos(a) + 0.3 * sin(tilt), rng.uniform(-0.3, 0.3)]
            return common | {"kind": "half_space", "point": point, "normal": normal}


@asynccontextmanager
async def homed(machine: Machine, place: Joints) -> AsyncIterator[Rig]:
    """Give a rig of the machine that stands at `place`, homed without moving, whose mechanics keep samples."""
    async with rig(machine.config, truth=machine.truth, start=StartPose(*place), trace=True) as bench:
        await take_over(bench.controller, bench.virtual, place, machine.truth)
        yield bench


def twin_of(machine: Machine, place: Joints) -> tuple[VirtualController, MayaMechanics]:
    """Return the machine's twin, switched on at `place`, and its mechanics, which keep samples."""
    mechanics = MayaMechanics(machine.truth, StartPose(*place), trace=True)
    return VirtualController(VirtualDmc(mechanics)), mechanics
