"""Machines and starts as they are drawn."""

from __future__ import annotations

from math import pi
from random import Random

import numpy as np
import pytest

from maya_un.machine.truth import Statics, TrueConstants, legal_start

MACHINES = [TrueConstants.drawn(Random(seed)) for seed in range(50)]


def test_the_default_machine_is_the_manuals() -> None:
    truth = TrueConstants()
    assert truth.width == pytest.approx(2.0)
    assert truth.scale == pytest.approx((371.06 * 180 / pi, 1e6, 1e6))
    assert truth.switches == ((0.0, pytest.approx(2 * pi / 3)), (0.575, 2.260), (0.565, 2.300))


def test_random_machines_stay_within_the_tolerance_of_homing() -> None:
    for truth in MACHINES:
        for (reverse, forward), (short, long) in zip(truth.switches, TrueConstants().switches, strict=True):
            assert reverse == short
            assert abs(forward / long - 1.0) <= 0.03
        assert all(0.02 <= friction <= 0.25 for friction in truth.friction)
        assert all(0.005 <= lag <= 0.040 for lag in truth.lag)
        assert all(0.012 <= gap <= 0.030 for gap in truth.gaps[1:])
        assert all(
            0.5 <= k / nominal <= 2.0
            for k, nominal in zip(truth.stall_stiffness, TrueConstants().stall_stiffness, strict=True)
        )


def test_random_machines_differ_and_repeat_by_seed() -> None:
    assert len(set(MACHINES)) == len(MACHINES)
    assert TrueConstants.drawn(Random(7)) == MACHINES[7]


def test_numpy_draws_as_well() -> None:
    truth = TrueConstants.drawn(np.random.default_rng(3))
    assert legal_start(np.random.default_rng(3), truth) == legal_start(np.random.default_rng(3), truth)


def test_wiring_can_be_inverted_as_a_whole_by_axis_and_by_switch() -> None:
    assert TrueConstants().with_wiring(True).active_high == ((True, True),) * 3
    assert TrueConstants().with_wiring(True, axis=1).active_high == ((False, False), (True, True), (False, False))
    one = TrueConstants().with_wiring(True, axis=2, switch="forward")
    assert one.active_high == ((False, False), (False, False), (False, True))
    every = TrueConstants().with_wiring(True, switch="reverse")
    assert every.active_high == ((True, False),) * 3


def test_starts_are_legal_and_of_every_kind() -> None:
    rng, kinds = Random(11), set[str]()
    for truth in MACHINES * 8:
        start = legal_start(rng, truth)
        hang = Statics.of(truth).hang(start.b, start.c)
        on = [not low < q < high for q, (low, high) in zip(start, truth.switches, strict=True)]
        assert start.b + start.c > truth.width
        assert hang.tension <= 5.0
        assert hang.slack <= (0.25 if any(on[1:]) else 0.0)
        assert hang.z >= (0.40 if any(on) else 0.10)
        for q, (low, high), gap in zip(start, truth.switches, truth.gaps, strict=True):
            assert low - gap < q < high + gap
        kinds.add("slack" if hang.slack else "switch" if any(on) else "low" if hang.z < 0.4 else "inside")
    assert kinds == {"slack", "switch", "low", "inside"}
