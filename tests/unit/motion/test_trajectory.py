from __future__ import annotations

import numpy as np
import pytest

from maya_un.config import Config, Units
from maya_un.kinematics import Mechanism
from maya_un.motion import CoordinatedMove, Limits, Path, lay, plan
from maya_un.motion.move import sample, stopping
from maya_un.values import Joints, Point

CONFIG = Config()
UNITS = Units.of(CONFIG)
LIMITS = Limits.of(CONFIG)
MECHANISM = Mechanism.of(CONFIG)


def moved(path: Path) -> CoordinatedMove:
    return plan(lay(path, MECHANISM, UNITS, LIMITS), LIMITS, UNITS)


CURVE = moved(Path.line(Point(0.3, 0.9, 0.5), Point(0.5, 1.5, 0.7)))


def test_samples_are_the_move_at_these_times() -> None:
    found = sample(CURVE, 41)
    assert found.time[0] == 0.0
    assert found.time[-1] == CURVE.duration
    for time, joints, velocity in zip(found.time, found.joints, found.velocity, strict=True):
        assert joints == pytest.approx(CURVE.position_at(time), abs=1e-12)
        if time < CURVE.duration:
            assert velocity == pytest.approx(CURVE.velocity_at(time), abs=1e-12)


def test_velocities_are_the_slopes_of_the_positions() -> None:
    found = sample(CURVE, 20_001)
    slopes = np.gradient(found.joints, found.time, axis=0)
    assert np.median(np.abs(slopes - found.velocity), axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)


def test_the_longest_stop_of_a_line_at_full_speed() -> None:
    # b alone at 45 mm/s: 45000/51200 = 0.88 s and half of that times the speed: 19.8 mm of the line.
    here = Joints(0.5, 1.5, 1.7)
    move = moved(Path.joints(here, here._replace(b=0.9)))
    found = stopping(move, MECHANISM)
    assert found.time == pytest.approx(45_000 / 51_200, rel=1e-3)
    begun, ended = (MECHANISM.fk(Joints(0.5, b, 1.7)) for b in (1.2, 1.2 - 0.0198))
    apart = np.linalg.norm(np.array(begun) - np.array(ended))
    assert found.distance == pytest.approx(apart, rel=0.15)


def test_no_stop_is_longer_than_the_longest() -> None:
    found = stopping(CURVE, MECHANISM)
    for time in np.linspace(0.0, CURVE.duration, 200):
        seconds, end = CURVE.stop_at(float(time))
        assert seconds <= found.time + 1e-9
        here, there = MECHANISM.fk(CURVE.position_at(float(time))), MECHANISM.fk(end)
        assert np.linalg.norm(np.array(here) - np.array(there)) <= found.distance + 1e-6
