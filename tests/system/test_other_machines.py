"""Machines of other sizes, none of them built quite as configured: homed, calibrated, and right after that."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from math import dist
from random import Random
from typing import NamedTuple

import numpy as np
import pytest

from dmc41x3.loops import run_virtual
from maya_un.assembly.controller import machine_of
from maya_un.config import Config, load
from maya_un.config.files import edited, parse
from maya_un.kinematics.calibration.fit import calibrate
from maya_un.kinematics.calibration.parameters import FittedConstants, Observations
from maya_un.kinematics.mechanism import Mechanism
from maya_un.machine.truth import StartPose, TrueConstants, legal_start
from maya_un.testing import rig
from maya_un.values import Joints, Point
from tests.campaign import Campaign
from tests.conventions.source import ROOT
from tests.machines import Machine
from tests.system.test_homing import other_size

pytestmark = pytest.mark.system

CLEAR = 0.03
"""The places are clear of every limit by this [m]: the machine is not quite as configured."""

POINTS, TARGETS = 14, 3
"""Places that are measured for a calibration, and others, which judge it."""


class Seen(NamedTuple):
    """Counts of a, b, c at rest, and where the gripper is by the mechanics and by the configuration [m]."""

    counts: tuple[int, int, int]
    true: Point
    believed: Point

    @property
    def off(self) -> float:
        return dist(self.true, self.believed)


async def seen(config: Config, truth: TrueConstants, start: StartPose, places: Sequence[Joints]) -> list[Seen]:
    """Home the machine, go to the places, and return what is seen there."""
    found: list[Seen] = []
    async with rig(config, truth=truth, start=start) as bench:
        await bench.controller.home()
        for place in places:
            await bench.controller.move(place)
            state = bench.controller.state
            assert state.joints is not None
            true = Point(*bench.mechanics.gripper_point())
            found.append(Seen(state.counts, true, Mechanism.of(config).fk(state.joints)))
        assert bench.mechanics.record.stall_time == 0.0
    return found


def require_calibration_helps(config: Config, rng: Random) -> None:
    """Fail unless a machine built roughly as configured is off before its calibration, and right after it."""
    truth = TrueConstants.built(rng, machine_of(config))
    start = legal_start(rng, truth)
    drawn = [Machine.of(config).drawn_place(rng, CLEAR) for _ in range(POINTS + TARGETS)]
    places = [place for place in drawn if place is not None]
    before = run_virtual(seen(config, truth, start, places))
    counts, points = (np.array(column, dtype=float) for column in list(zip(*before[TARGETS:], strict=True))[:2])
    fitted = calibrate(Observations(counts, points), FittedConstants.of(config)).fitted
    corrected = parse(tomllib.loads(edited("", fitted.keys(config))), config)
    after = run_virtual(seen(corrected, truth, start, places[:TARGETS]))
    assert max(one.off for one in before) > 1e-3
    assert max(one.off for one in after) < 5e-4


def test_machines_of_other_sizes_are_calibrated(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=3, long=60)):
        rng = campaign.rng(case)
        require_calibration_helps(other_size(rng), rng)


@pytest.mark.parametrize("name", ["table-top", "hall", "rewired"])
def test_machines_of_the_tutorial_are_calibrated(name: str, campaign: Campaign) -> None:
    require_calibration_helps(load(ROOT / "examples" / "machines" / f"{name}.toml"), campaign.rng(0))
