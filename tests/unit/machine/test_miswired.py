"""Machines with mistakes in their wiring: what their axes do, and what their encoders and switches say."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import pytest

from dmc41x3.twin.machine import VirtualDmc
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.miswired import built
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.machine.wiring import Wiring
from maya_un.machine.wiring_faults import KINDS, drawn

A, B, C = range(3)
LIMITS = b"TLB=2;ERB=1000;OEB=1;ACB=51200;DCB=51200;SPB=5000\r"


class Cabinet:
    """A controller on a machine with a wiring; `command` is executed at the present time."""

    def __init__(self, **mistakes: object) -> None:
        truth = TrueConstants(wiring=replace(Wiring(), **mistakes))  # pyright: ignore[reportArgumentType]
        self.body: MayaMechanics
        self.body, self.plant = built(truth, StartPose(1.0, 1.5, 1.5))
        self.machine = VirtualDmc(self.plant)
        handle = self.machine.connect()
        assert handle is not None
        self.handle = handle

    def send(self, commands: bytes) -> str:
        """Execute commands, and return the answers."""
        return self.machine.receive(self.handle, commands + b"\r", self.machine.now).decode()

    def moved(self, seconds: float) -> tuple[float, float, float]:
        """Let time pass, and return how far a, b, c moved truly [rad, m, m]."""
        before = self.body.true_joints()
        self.machine.advance(self.machine.now + seconds)
        a, b, c = (now - then for now, then in zip(self.body.true_joints(), before, strict=True))
        return a, b, c

    def counts(self) -> list[float]:
        """Return the encoder readings [counts]."""
        return [self.plant.position(axis) for axis in range(3)]


def tried(**mistakes: object) -> tuple[Cabinet, tuple[float, float, float]]:
    """Try to make line b longer by 2 mm, with a limited error."""
    cabinet = Cabinet(**mistakes)
    cabinet.send(LIMITS + b"SHB;PRB=2000;BGB")
    return cabinet, cabinet.moved(2.0)


def test_a_machine_without_mistakes_is_its_own_plant() -> None:
    body, plant = built(TrueConstants(), StartPose())
    assert plant is body


def test_a_reversed_encoder_runs_away_forward_until_the_error_limit() -> None:
    cabinet, (_, b, _) = tried(encoder_reversed=("b",))
    assert 0.0003 < b < 0.003
    assert cabinet.counts()[B] == pytest.approx(-1e6 * b)
    assert "1.0000" in cabinet.send(b"MG _MOB")


def test_a_reversed_motor_runs_away_backward() -> None:
    cabinet, (_, b, _) = tried(motor_reversed=("b",))
    assert -0.003 < b < -0.0003
    assert cabinet.counts()[B] == pytest.approx(1e6 * b)
    assert "1.0000" in cabinet.send(b"MG _MOB")


def test_two_reversals_move_backward_and_look_right() -> None:
    cabinet, (_, b, _) = tried(motor_reversed=("b",), encoder_reversed=("b",))
    assert b == pytest.approx(-0.002, abs=1e-4)
    assert "0.0000" in cabinet.send(b"MG _MOB")


def test_a_dead_encoder_is_switched_off_by_the_error_limit() -> None:
    cabinet, (_, b, _) = tried(encoder_dead=("b",))
    assert 0.0 < b < 0.02
    assert cabinet.counts()[B] == 0.0
    assert "1.0000" in cabinet.send(b"MG _MOB")


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_an_encoder_with_a_wrong_scale_moves_too_far_or_too_little(factor: float) -> None:
    cabinet, (_, b, _) = tried(encoder_factor=(1.0, factor, 1.0))
    assert b == pytest.approx(0.002 / factor, rel=0.1)
    assert cabinet.counts()[B] == pytest.approx(2000.0, abs=200.0)


def test_exchanged_motors_move_the_other_axis() -> None:
    cabinet, (_, b, c) = tried(motors_exchanged=("b", "c"))
    assert b == 0.0
    assert 0.0 < c < 0.02
    assert cabinet.counts() == [0.0, 0.0, pytest.approx(1e6 * c)]


def test_exchanged_encoders_count_the_other_axis() -> None:
    cabinet, (_, b, c) = tried(encoders_exchanged=("b", "c"))
    assert c == 0.0
    assert cabinet.counts() == [0.0, 0.0, pytest.approx(1e6 * b)]


@pytest.mark.parametrize("field", ["amplifier_off", "brake_closed"])
def test_without_power_or_with_a_closed_brake_nothing_moves(field: str) -> None:
    cabinet, ways = tried(**{field: ("b",)})
    assert ways == (0.0, 0.0, 0.0)
    assert "1.0000" in cabinet.send(b"MG _MOB")


def test_a_hand_presses_a_switch() -> None:
    cabinet = Cabinet()
    assert cabinet.plant.inputs(B) == (True, True, True)
    cabinet.body.press(B, "forward", down=True)
    assert cabinet.plant.inputs(B) == (False, True, True)
    cabinet.body.press(B, "forward", down=False)
    assert cabinet.plant.inputs(B) == (True, True, True)


def test_switches_are_exchanged_open_or_inverted() -> None:
    cabinet = Cabinet(switches_exchanged=("a",), switch_open=("b forward",), switch_inverted=("c reverse",))
    for axis in range(3):
        cabinet.body.press(axis, "forward", down=True)
    assert cabinet.plant.inputs(A) == (True, False, True)
    assert cabinet.plant.inputs(B) == (True, True, True)
    assert cabinet.plant.inputs(C) == (False, False, True)


@pytest.mark.parametrize(
    ("stop", "reads"), [("wired", (False, True)), ("open", (False, False)), ("inverted", (True, False))]
)
def test_the_stop_reaches_the_input_by_its_wiring(stop: str, reads: tuple[bool, bool]) -> None:
    wiring = replace(Wiring(), stop=stop)  # pyright: ignore[reportArgumentType]
    assert (wiring.abort_active(pressed=False), wiring.abort_active(pressed=True)) == reads


def test_an_unknown_axis_is_refused() -> None:
    with pytest.raises(ValueError, match="axes are"):
        Wiring(encoder_dead=("d",))


@pytest.mark.parametrize("kind", KINDS)
def test_every_drawn_mistake_changes_the_machine(kind: str) -> None:
    plan = TrueConstants()
    for seed in range(5):
        fault = drawn(Random(seed), plan, kind)
        assert fault.truth != plan
        assert fault == drawn(Random(seed), plan, kind)
