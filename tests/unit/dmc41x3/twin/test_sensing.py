"""Broken sensors: readings differ from the truth."""

from __future__ import annotations

import pytest

from dmc41x3.twin.plant import BenchPlant, Sensing
from dmc41x3.twin.timeline import TimelinePiece
from maya_un.machine.mechanics import MayaMechanics
from tests.unit.dmc41x3.twin.bench import Bench


def test_encoder_stops_and_then_continues_from_there() -> None:
    sensing = Sensing()
    sensing.fail_encoder(0, 100.0, True)
    sensing.fail_encoder(0, 150.0, True)
    assert (sensing.position(0, 170.0), sensing.velocity(0, 5.0)) == (100.0, 0.0)
    sensing.fail_encoder(0, 180.0, False)
    assert (sensing.position(0, 200.0), sensing.velocity(0, 5.0)) == (120.0, 5.0)
    sensing.fail_encoder(0, 210.0, False)
    assert sensing.position(1, 7.0) == 7.0


def test_maya_continues_without_its_encoder_and_its_record_knows() -> None:
    maya = MayaMechanics()
    maya.power(0, True)
    start = maya.true_joints()[0]
    maya.timelines[0].plan(0.0, (TimelinePiece(0.0, 0.0, 2000.0, 0.0), TimelinePiece(2.0, 4000.0, 0.0, 0.0)))
    maya.advance(1.0)
    read = maya.position(0)
    maya.fail_encoder(0, True)
    maya.advance(3.0)
    turned = maya.true_joints()[0] - start
    assert (maya.position(0), maya.velocity(0)) == (read, 0.0)
    assert turned * maya.truth.scale[0] == pytest.approx(4000.0)
    assert abs(maya.torque(0)) > 9.0
    assert maya.record.whole.high[0] - start == pytest.approx(turned)


def test_maya_does_not_jump_when_it_is_switched_on_with_a_wrong_encoder() -> None:
    maya = MayaMechanics()
    maya.power(0, True)
    maya.timelines[0].plan(0.0, (TimelinePiece(0.0, 0.0, 2000.0, 0.0), TimelinePiece(2.0, 4000.0, 0.0, 0.0)))
    maya.advance(1.0)
    maya.fail_encoder(0, True)
    maya.advance(3.0)
    there = maya.true_joints()[0]
    maya.fail_encoder(0, False)
    read = maya.position(0)
    maya.timelines[0].plan(3.0, (TimelinePiece(3.0, read, 1000.0, 0.0), TimelinePiece(4.0, read + 1000.0, 0.0, 0.0)))
    maya.power(0, True)
    maya.advance(3.0 + 1e-9)
    assert maya.true_joints()[0] == pytest.approx(there)
    maya.advance(5.0)
    assert (maya.true_joints()[0] - there) * maya.truth.scale[0] == pytest.approx(1000.0)
    assert maya.position(0) == pytest.approx(read + 1000.0)


def test_maya_s_switches_can_stick() -> None:
    maya = MayaMechanics()
    forward, reverse, home = maya.inputs(1)
    maya.force_inputs(1, forward=not forward)
    assert maya.inputs(1) == (not forward, reverse, home)
    maya.force_inputs(1, forward=None)
    assert maya.inputs(1) == (forward, reverse, home)


def test_a_stuck_switch_stops_an_axis() -> None:
    bench = Bench()
    bench.do("JGA=1000;BGA")
    bench.at(1.0).plant.force_inputs(0, forward=False)
    bench.machine.look()
    assert bench.value("_SCA") == 2.0
    bench.plant.force_inputs(0, forward=None)
    assert bench.at(2.0).value("_LFA") == 1.0


def test_a_lost_encoder_shows_as_following_error_until_sh() -> None:
    bench = Bench()
    bench.do("JGA=1024;BGA")
    bench.at(1.0).plant.fail_encoder(0, True)
    before = bench.value("_TPA")
    assert bench.at(2.0).value("_TEA") == pytest.approx(1024.0)
    assert bench.value("_TPA") == before
    bench.plant.fail_encoder(0, False)
    bench.do("AB 1", "SHA")
    assert bench.value("_TEA") == 0.0
    assert isinstance(bench.plant, BenchPlant)
