"""A machine that has nothing to do goes over time in one step, and forgets nobody who has something to do again."""

from __future__ import annotations

import pytest

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.network import HandleProtocol
from dmc41x3.twin.plant import BenchPlant

LONG = 1000.0
"""Longer than anything waits here [s]."""


class Idler:
    """A machine of two axes, with the motors on, that has long been idle."""

    def __init__(self) -> None:
        self.plant = BenchPlant(2)
        self.machine = VirtualDmc(self.plant, axes=2)
        handle = self.machine.connect()
        assert handle is not None
        self.handle = handle
        self.say("SH")
        self.idle()

    def say(self, text: str) -> str:
        """Send a line and return what it prints."""
        reply = self.machine.receive(self.handle, f"{text}\r".encode("ascii"), self.machine.now).decode("ascii")
        assert "?" not in reply, (text, reply)
        return reply.strip(":\r\n ")

    def ask(self, expression: str) -> float:
        """Return the value of an expression."""
        return float(self.say(f"MG {expression}"))

    def idle(self, seconds: float = LONG) -> None:
        """Let time go by, and see that it is one step and no more."""
        steps: list[float] = []
        advance = self.plant.advance

        def counted(t: float) -> None:
            steps.append(t)
            advance(t)

        self.plant.advance = counted
        self.machine.advance(self.machine.now + seconds)
        self.plant.advance = advance
        assert steps == [self.machine.now]

    def go(self, seconds: float) -> None:
        """Let time go by."""
        self.machine.advance(self.machine.now + seconds)

    def program(self, text: str) -> None:
        """Download a program."""
        self.machine.receive(self.handle, f"DL\r{text}\\".encode("ascii"), self.machine.now)

    def input(self, bit: int, high: bool) -> None:
        """Set an input."""
        self.machine.unit.set_input(bit, high)
        self.machine.look()


@pytest.fixture
def idler() -> Idler:
    return Idler()


def test_a_recorder_records_and_then_rests(idler: Idler) -> None:
    idler.say("DM a[10]")
    idler.say("RA a[]")
    idler.say("RD _TPA")
    idler.idle()
    idler.say("RC 1")
    idler.go(0.05)
    assert idler.ask("_RC") == 0.0
    idler.idle()


def test_a_latch_sees_the_edges_behind_its_arming_only(idler: Idler) -> None:
    idler.input(1, high=False)
    idler.idle()
    idler.say("ALA")
    idler.input(2, high=False)
    idler.idle()
    assert idler.ask("_ALA") == 1.0
    idler.input(1, high=True)
    idler.input(1, high=False)
    assert idler.ask("_ALA") == 0.0
    idler.say("ALA")
    assert idler.ask("_ALA") == 1.0


def test_a_compared_position_is_met(idler: Idler) -> None:
    idler.say("OCA=100")
    idler.idle()
    idler.say("PRA=200;BGA")
    idler.go(5.0)
    assert idler.ask("_OCA") == 1.0
    idler.idle()


def test_a_slave_follows_a_master_that_moves_late(idler: Idler) -> None:
    idler.say("GA,A")
    idler.say("GRB=2")
    idler.go(1.0)
    idler.say("PRA=500;BGA")
    idler.go(5.0)
    assert idler.ask("_TPB") == 1000.0
    idler.say("GRB=0")
    idler.idle()


def test_a_cam_works_once_it_is_enabled(idler: Idler) -> None:
    for line in ("EAA", "EMA=1000", "EMB=0", "EP500,0", "ET[0]=,0", "ET[1]=,300", "ET[2]=,0"):
        idler.say(line)
    idler.idle()
    idler.say("EB1")
    idler.say("EG,0")
    idler.say("PRA=500;BGA")
    idler.go(5.0)
    assert idler.ask("_TPB") == 300.0


def test_a_dead_encoder_is_found_after_a_long_rest(idler: Idler) -> None:
    idler.say("OTA=100;OVA=1;OAA=1")
    idler.go(10.0)
    idler.plant.hold(0)
    idler.say("PRA=5000;BGA")
    idler.go(5.0)
    assert idler.ask("_MOA") == 1.0


def test_a_stream_of_records_begins_and_ends(idler: Idler) -> None:
    other = idler.machine.connect(("127.0.0.1", 7000), HandleProtocol.UDP)
    assert other is not None
    idler.say("DR1000,1")
    idler.go(10.0)
    assert len(idler.machine.take_messages()) == 10
    idler.say("DR0,1")
    idler.idle()
    assert idler.machine.take_messages() == []


@pytest.mark.parametrize("cause", ["input", "abort", "amplifier", "time"])
def test_a_program_wakes_up(idler: Idler, cause: str) -> None:
    idler.program("#GO\rWT500000\rx=1\rEN\r#HOLD\rJP#HOLD\r#ININT\rx=2\rRI\r#AMPERR\rx=3\rRE\r")
    idler.say("x=0")
    idler.idle()
    if cause == "time":
        idler.say("XQ#GO")
    else:
        idler.say("II1;XQ#HOLD")
        idler.go(1.0)
    match cause:
        case "input":
            idler.input(1, high=False)
        case "abort":
            idler.machine.abort_input(True)
        case "amplifier":
            idler.machine.amplifier_fault(1)
        case _:
            idler.go(400.0)
            assert idler.ask("x") == 0.0
            idler.go(100.0)
    idler.go(1.0)
    assert idler.ask("x") == {"input": 2.0, "abort": 0.0, "amplifier": 3.0, "time": 1.0}[cause]
    if cause in ("abort", "time"):
        assert idler.ask("_XQ") == -1.0
        idler.idle()


def test_a_dead_encoder_calls_its_subroutine(idler: Idler) -> None:
    idler.program("#HOLD\rJP#HOLD\r#POSERR\rx=7\rRE\r")
    idler.say("x=0;XQ#HOLD")
    idler.say("OTA=100;OVA=1;OAA=1;ERA=-1")
    idler.plant.hold(0)
    idler.say("PRA=5000;BGA")
    idler.go(5.0)
    assert idler.ask("_MOA") == 1.0
    assert idler.ask("x") == 7.0


def test_a_brake_lets_its_motor_go_in_time(idler: Idler) -> None:
    idler.say("BWA=512")
    idler.idle()
    idler.say("MOA")
    idler.go(0.49)
    assert idler.plant.powered[0]
    idler.go(0.02)
    assert not idler.plant.powered[0]


def test_a_shaft_held_fast_is_looked_at(idler: Idler) -> None:
    idler.plant.hold(0)
    looks: list[float] = []
    event = idler.plant.next_event
    idler.plant.next_event = lambda until: looks.append(until) or event(until)
    idler.go(0.1)
    assert len(looks) >= 50
    idler.plant.release(0)
    idler.idle()


def test_reset_ends_active_motion(idler: Idler) -> None:
    idler.say("DM a[10]")
    idler.say("RA a[]")
    idler.say("RD _TPA")
    idler.say("RC 1,-10;OCA=50;OAA=1")
    idler.go(0.1)
    idler.machine.receive(idler.handle, b"RS\r", idler.machine.now)
    handle = idler.machine.connect()
    assert handle is not None
    idler.handle = handle
    idler.idle()
    idler.machine.power_off()
    idler.idle()
    idler.machine.power_on()
    idler.idle()
