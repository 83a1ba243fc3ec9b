"""The conformance table held against a real controller, where an address is given, and two facts of its record."""

from __future__ import annotations

import pytest

from dmc41x3.cli.conform import axes_of
from dmc41x3.conformance import ControllerChannel, Vector, load, run
from dmc41x3.language.record import DataRecord, decode
from tests.channels import Bench
from tests.contract.conftest import ADDRESS, ALLOWED, box, place

AXES = axes_of(*place()) if ADDRESS else 3
FITTING = [vector for vector in load() if vector.fits(AXES) and vector.demands <= ALLOWED]


def talkers() -> list[str]:
    return ["virtual", *(["box"] if ADDRESS else [])]


def opened(talker: str) -> ControllerChannel:
    return box() if talker == "box" else Bench(AXES).dial()


def record(channel: ControllerChannel) -> DataRecord:
    channel.send(b"QR\r")
    data = b""
    while len(data) < 4 or len(data) <= int.from_bytes(data[2:4], "little"):
        more = channel.receive()
        assert more, data
        data += more
    return decode(data[:-1])


def value(channel: ControllerChannel, operand: str) -> float:
    channel.send(f"MG {operand}\r".encode("ascii"))
    answer = b""
    while answer[-1:] != b":":
        more = channel.receive()
        assert more, answer
        answer += more
    return float(answer[:-3])


if ADDRESS:

    @pytest.mark.parametrize("vector", FITTING, ids=lambda vector: f"{vector.group}: {vector.name}")
    def test_the_box_answers_by_the_table(vector: Vector) -> None:
        assert run(vector, box, AXES) is None


@pytest.mark.parametrize("talker", talkers())
def test_positions_in_the_record_are_those_of_the_operands(talker: str) -> None:
    channel = opened(talker)
    found = record(channel)
    for letter, axis in zip("ABCDEFGH", found.axes, strict=False):
        assert axis.reference == pytest.approx(value(channel, f"_RP{letter}"), abs=2)
    assert len(found.axes) == value(channel, "_BV")
    channel.close()


@pytest.mark.parametrize("talker", talkers())
def test_limits_in_the_record_are_those_of_the_operands(talker: str) -> None:
    channel = opened(talker)
    for letter, axis in zip("ABCDEFGH", record(channel).axes, strict=False):
        forward, reverse = value(channel, f"_LF{letter}"), value(channel, f"_LR{letter}")
        assert (not axis.forward_limit_active, not axis.reverse_limit_active) == (forward == 1.0, reverse == 1.0)
    channel.close()
