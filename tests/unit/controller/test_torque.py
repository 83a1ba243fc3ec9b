from __future__ import annotations

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.controller.registers import FRICTION, HOLD, HOMING, SPARE, Torque, commands
from maya_un.machine.truth import Statics
from tests.unit.controller.bench import FAR, HERE, foreign, homed
from tests.virtual_time import elapse

PER_LOAD = Config().homing.torque_per_load
STEP = 20.0 / 65536.0


def test_peak_is_the_greatest_tension_of_the_knots() -> None:
    knots = np.array([[0.0, 1.5, 1.3], [0.5, 1.2, 0.9], [1.0, 1.6, 1.6]])
    statics = Statics(width=2.0)
    assert Torque(Config()).peak(knots) == pytest.approx(max(statics.hang(b, c).tension for _, b, c in knots.tolist()))


def test_axis_outside_the_motion_gets_the_torque_of_rest() -> None:
    torque = Torque(Config())
    assert torque.rest == pytest.approx({"B": HOLD * PER_LOAD, "C": HOLD * PER_LOAD}, abs=STEP)
    assert torque.homing([2]) == pytest.approx({"B": HOLD * PER_LOAD, "C": HOMING * PER_LOAD}, abs=STEP)
    assert torque.travel([0], np.array([[0.0, 1.5, 1.3]])) == torque.rest


def test_drum_that_does_not_lock_keeps_the_torque_that_holds_any_load() -> None:
    config = parse({"safety": {"self_locking": False}})
    torque = Torque(config)
    most = (SPARE * config.safety.tension_limit + FRICTION) * PER_LOAD
    for limits in (torque.rest, torque.homing([1]), torque.travel([0], np.zeros((1, 3)) + 1.5)):
        assert limits == pytest.approx({"B": most, "C": most}, abs=STEP)


def test_limit_is_within_the_range_of_the_controller() -> None:
    torque = Torque(parse({"homing": {"torque_per_load": 9.0}}))
    assert torque.most == pytest.approx({"B": 9.9982, "C": 9.9982}, abs=STEP)


def test_commands_name_the_axes_of_a_permuted_machine() -> None:
    config = parse({"axes": {"a": {"letter": "C"}, "b": {"letter": "A"}, "c": {"letter": "B"}}})
    assert commands(Torque(config).rest) == ["TLA=0.12483", "TLB=0.12483"]


async def test_lines_have_torque_only_while_they_move() -> None:
    async with homed() as bench:
        assert await foreign(bench, "MG _TLA,_TLB,_TLC") == ["9.9982 0.1248 0.1248"]
        await bench.controller.move(FAR)
        moved = bytes(bench.sent).decode()
        assert "TLB=1." in moved
        assert await foreign(bench, "MG _TLB,_TLC") == ["0.1248 0.1248"]
        await bench.controller.move(HERE._replace(b=FAR.b, c=FAR.c))
        assert bytes(bench.sent).decode()[len(moved) :].count("TL") == 0


async def test_after_a_lost_link_the_next_program_still_finds_torque_limits_that_lift() -> None:
    async with homed(live=True) as bench:
        transport = bench.controller._monitor.link.driver._transport
        await transport.close()
        await elapse(3.0)
        await bench.controller.close()
        volts = [float(word) for word in (await foreign(bench, "MG _TLB,_TLC"))[0].split()]
        most = Torque(bench.controller.config).most
        assert volts == pytest.approx([most["B"], most["C"]], abs=1e-3)
