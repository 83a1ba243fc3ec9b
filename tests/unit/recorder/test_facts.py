"""Facts in the records."""

from __future__ import annotations

from dataclasses import replace

from dmc41x3.language.record import AxisRecord, AxisStatus, AxisSwitches, DataRecord, encode
from dmc41x3.wire.framing import RecordReply, Reply
from maya_un.recorder.compare import Fact, RecordedMotion, RecordSample, facts, motions, samples
from maya_un.recorder.exchanges import RecordedExchange

REST = DataRecord(axes=(AxisRecord(),) * 3)


def moving(reference: int) -> DataRecord:
    axis = AxisRecord(status=AxisStatus.MOVING | AxisStatus.COORDINATED, reference=reference)
    return replace(REST, axes=(AxisRecord(), axis, axis))


def resting(reference: int) -> DataRecord:
    axis = AxisRecord(reference=reference)
    return replace(REST, axes=(AxisRecord(), axis, axis))


def test_records_are_found_among_the_answers_and_broken_ones_skipped() -> None:
    exchanges = [
        RecordedExchange(1.0, 1, "TP", Reply(True, "1"), 1.0),
        RecordedExchange(2.0, 1, "QR", RecordReply(encode(REST)), 2.0),
        RecordedExchange(3.0, 1, "QR", RecordReply(b"\x87\x00\x05\x00x"), 3.0),
        RecordedExchange(4.0, 1, "QR", None, None),
    ]
    assert samples(exchanges) == [RecordSample(2.0, REST)]


def test_a_motion_is_from_its_first_record_to_the_first_at_rest() -> None:
    records = [
        RecordSample(0.0, moving(10)),
        RecordSample(0.05, resting(20)),
        RecordSample(0.1, resting(20)),
        RecordSample(0.15, moving(30)),
        RecordSample(0.2, moving(40)),
        RecordSample(0.25, resting(50)),
        RecordSample(0.3, moving(60)),
    ]
    assert motions(records) == [
        RecordedMotion(0.0, 0.05, (0, 20, 20)),
        RecordedMotion(0.15, 0.25, (0, 50, 50)),
        RecordedMotion(0.3, None, None),
    ]
    assert motions([]) == []


def test_changes_of_switches_motors_and_outputs_are_facts() -> None:
    at_limit = AxisRecord(switches=AxisSwitches.REVERSE_INACTIVE)
    off = AxisRecord(status=AxisStatus.MOTOR_OFF)
    records = [
        RecordSample(1.0, REST),
        RecordSample(2.0, replace(REST, axes=(AxisRecord(), at_limit, off))),
        RecordSample(3.0, replace(REST, outputs=(0b101, *REST.outputs[1:]), amplifier_status=1 << 24)),
        RecordSample(4.0, replace(REST, outputs=(0b100, *REST.outputs[1:]))),
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
