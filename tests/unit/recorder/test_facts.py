"""What records say that happened."""

from __future__ import annotations

from dataclasses import replace

from maya_un.galil.framing import Record, Reply
from maya_un.galil.record import AxisRecord, DataRecord, Status, Switch, encode
from maya_un.recorder.exchanges import Exchange
from maya_un.recorder.facts import Fact, Motion, Sample, facts, motions, samples

REST = DataRecord(axes=(AxisRecord(),) * 3)


def moving(reference: int) -> DataRecord:
    axis = AxisRecord(status=Status.MOVING | Status.COORDINATED, reference=reference)
    return replace(REST, axes=(AxisRecord(), axis, axis))


def resting(reference: int) -> DataRecord:
    axis = AxisRecord(reference=reference)
    return replace(REST, axes=(AxisRecord(), axis, axis))


def test_records_are_found_among_the_answers_and_broken_ones_passed_over() -> None:
    exchanges = [
        Exchange(1.0, 1, "TP", Reply(True, "1"), 1.0),
        Exchange(2.0, 1, "QR", Record(encode(REST)), 2.0),
        Exchange(3.0, 1, "QR", Record(b"\x87\x00\x05\x00x"), 3.0),
        Exchange(4.0, 1, "QR", None, None),
    ]
    assert samples(exchanges) == [Sample(2.0, REST)]


def test_a_motion_is_from_its_first_record_to_the_first_at_rest() -> None:
    records = [
        Sample(0.0, moving(10)),
        Sample(0.05, resting(20)),
        Sample(0.1, resting(20)),
        Sample(0.15, moving(30)),
        Sample(0.2, moving(40)),
        Sample(0.25, resting(50)),
        Sample(0.3, moving(60)),
    ]
    assert motions(records) == [
        Motion(0.0, 0.05, (0, 20, 20)),
        Motion(0.15, 0.25, (0, 50, 50)),
        Motion(0.3, None, None),
    ]
    assert motions([]) == []


def test_what_changes_at_switches_motors_and_outputs_is_a_fact() -> None:
    at_limit = AxisRecord(switches=Switch.REVERSE_INACTIVE)
    off = AxisRecord(status=Status.MOTOR_OFF)
    records = [
        Sample(1.0, REST),
        Sample(2.0, replace(REST, axes=(AxisRecord(), at_limit, off))),
        Sample(3.0, replace(REST, outputs=(0b101, *REST.outputs[1:]), amplifier_status=1 << 24)),
        Sample(4.0, replace(REST, outputs=(0b100, *REST.outputs[1:]))),
    ]
    assert facts(records) == [
        Fact(2.0, "met the forward limit of B"),
        Fact(2.0, "motor off: C"),
        Fact(3.0, "left the forward limit of B"),
        Fact(3.0, "motor on: C"),
        Fact(3.0, "amplifier status 0x01000000"),
        Fact(3.0, "output 1 on"),
        Fact(3.0, "output 3 on"),
        Fact(4.0, "amplifier status 0x00000000"),
        Fact(4.0, "output 1 off"),
    ]
