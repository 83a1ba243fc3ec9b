"""TS, and the bits of the data record: the meaning of 1 and 0."""

from __future__ import annotations

import pytest

from dmc41x3.language.record import AxisStatus, AxisSwitches
from tests.unit.dmc41x3.twin.bench import Bench

AT_REST = 0b1111


@pytest.mark.parametrize(
    ("commands", "inputs", "byte"),
    [
        ([], {}, AT_REST),
        (["MOA"], {}, AT_REST | 32),
        ([], {"forward": False}, AT_REST & ~8),
        ([], {"reverse": False}, AT_REST & ~4),
        ([], {"home": False}, AT_REST & ~2),
        (["CN ,1"], {}, AT_REST & ~2),
        (["CN 1"], {}, AT_REST & ~12),
        (["CN 1"], {"forward": False, "reverse": False}, AT_REST),
        (["LDA=3"], {"forward": False}, AT_REST & ~8),
        (["ALA"], {}, AT_REST & ~1),
        (["JGA=2;BGA"], {}, AT_REST | 128),
    ],
)
def test_ts(commands: list[str], inputs: dict[str, bool], byte: int) -> None:
    bench = Bench()
    bench.switch(0, **inputs)
    bench.do(*commands)
    assert bench.value("_TSA") == byte
    assert bench.say("TSA") == f" {byte}\r\n:"
    record = bench.record().axes[0]
    assert bool(record.switches & AxisSwitches.FORWARD_INACTIVE) is bool(byte & 8) is bool(bench.value("_LFA"))
    assert bool(record.switches & AxisSwitches.REVERSE_INACTIVE) is bool(byte & 4) is bool(bench.value("_LRA"))
    assert bool(record.switches & AxisSwitches.HOME_INPUT) is bool(byte & 2) is bool(bench.value("_HMA"))
    assert bool(record.status & AxisStatus.LATCH_ARMED) is not bool(byte & 1)
    assert record.motor_off is bool(byte & 32)
    assert record.moving is bool(byte & 128)


@pytest.mark.parametrize(("limit", "shown"), [(999, True), (1000, False), (0, True), (-1, False)])
def test_an_error_beyond_er_shows(limit: int, shown: bool) -> None:
    bench = Bench()
    bench.plant.hold(0)
    bench.do("PRA=1000;BGA", f"ERA={limit}")
    bench.at(5.0)
    assert bench.value("_TEA") == 1000.0
    assert bool(int(bench.value("_TSA")) & 64) is shown
    assert bench.record().axes[0].error == 1000


@pytest.mark.parametrize(
    ("begin", "bits"),
    [
        ("PAA=90000", AxisStatus.MOVING | AxisStatus.POSITION_MODE | AxisStatus.ABSOLUTE_MODE | AxisStatus.SLEWING),
        ("PRA=90000", AxisStatus.MOVING | AxisStatus.POSITION_MODE | AxisStatus.SLEWING),
        ("JGA=2048", AxisStatus.MOVING | AxisStatus.SLEWING),
        ("JGA=-2048", AxisStatus.MOVING | AxisStatus.SLEWING | AxisStatus.NEGATIVE),
        ("FEA", AxisStatus.MOVING | AxisStatus.FINDING_EDGE | AxisStatus.SLEWING | AxisStatus.NEGATIVE),
        ("HMA", AxisStatus.MOVING | AxisStatus.HOMING | AxisStatus.SLEWING | AxisStatus.NEGATIVE),
        ("JGA=2048;FIA", AxisStatus.MOVING | AxisStatus.HOMING_SECOND_DONE | AxisStatus.SLEWING),
        ("LM A;LI 90000;LE", AxisStatus.MOVING | AxisStatus.COORDINATED | AxisStatus.SLEWING),
        ("LM A;LI -90000;LE", AxisStatus.MOVING | AxisStatus.COORDINATED | AxisStatus.SLEWING | AxisStatus.NEGATIVE),
    ],
)
def test_status_word_has_the_kind_of_motion(begin: str, bits: int) -> None:
    bench = Bench()
    bench.do("SPA=2048;VS 2048", begin, "BGS" if begin[0] == "L" else "BGA")
    assert bench.at(1.0).record().axes[0].status == bits
    bench.do("ST")
    stopping = bench.record().axes[0]
    assert stopping.stopping
    assert stopping.stop_code == 4
    assert bench.at(9.0).record().axes[0].status == 0


def test_the_stages_of_a_homing_show_in_order() -> None:
    bench = Bench()
    bench.do("SPA=4096;HVA=512", "HMA;BGA")
    bench.at(2.0)
    stages = [bench.record().axes[0].status]
    bench.switch(0, home=False)
    stages.append(bench.at(3.0).record().axes[0].status)
    bench.switch(0, home=True)
    stages.append(bench.at(3.1).record().axes[0].status)
    marks = AxisStatus.HOMING_FIRST_DONE | AxisStatus.HOMING_SECOND_DONE | AxisStatus.HOMING_THIRD
    assert [stage & marks for stage in stages] == [
        0,
        AxisStatus.HOMING_FIRST_DONE,
        marks,
    ]
    assert all(stage & AxisStatus.HOMING for stage in stages)


def test_plane_reports_its_phase() -> None:
    bench = Bench()
    bench.do("VS 10240;VA 10240;VD 10240", "LM A;LI 51200;LE", "BGS")
    seen = [bench.at(t).record().s.status for t in (0.5, 3.0, 5.5, 7.0)]
    assert seen == [
        AxisStatus.MOVING,
        AxisStatus.MOVING | AxisStatus.SLEWING,
        AxisStatus.MOVING | AxisStatus.FINAL_DECELERATION,
        0,
    ]


@pytest.mark.parametrize(
    ("blocks", "length", "flags", "present"),
    [
        ("I", 4 + 52 + 6, 4, 0),
        ("S", 4 + 10, 1, 0),
        ("T", 4 + 10, 2, 0),
        ("A", 4 + 36, 0, 1),
        ("CA", 4 + 72, 0, 5),
        ("ABCSTI", 190, 7, 7),
        (" A B ", 4 + 72, 0, 3),
    ],
)
def test_a_record_of_some_blocks(blocks: str, length: int, flags: int, present: int) -> None:
    bench = Bench()
    data = bench.raw(f"QR {blocks}\r")[:-1]
    assert len(data) == int.from_bytes(data[2:4], "little") == length
    assert (data[0] & 7, data[1]) == (flags, present)


def test_a_record_ends_with_its_prompt_alone() -> None:
    data = Bench().raw("QR\r")
    assert (len(data), data[-1:], data[-3:-1] != b"\r\n") == (191, b":", True)
    assert data[:4] == bytes((0x87, 7, 190, 0))


@pytest.mark.parametrize(
    ("status", "byte"), [(0x01000000, (1, 0, 0, 0)), (0x00020000, (0, 2, 0, 0)), (0x0000FF03, (0, 0, 255, 3))]
)
def test_amplifiers_have_four_bytes(status: int, byte: tuple[int, ...]) -> None:
    bench = Bench()
    bench.machine.amplifier_fault(status)
    assert tuple(int(bench.value(f"_TA{n}")) for n in range(4)) == byte
    assert bench.record().amplifier_status == status


def test_the_record_saturates_at_32_bits() -> None:
    bench = Bench()
    bench.do("DPA=2147483000", "PRA=5000;BGA")
    assert bench.at(9.0).record().axes[0].reference == 2**31 - 1


def test_record_has_velocity_times_64_and_the_low_half_of_time() -> None:
    bench = Bench()
    bench.do("JGA=-2048;ACA=1073740800;BGA")
    record = bench.at(100.0).record()
    assert record.axes[0].velocity_raw == -64 * 2048
    assert record.sample == 102_400 & 0xFFFF
    assert record.error_code == 0
