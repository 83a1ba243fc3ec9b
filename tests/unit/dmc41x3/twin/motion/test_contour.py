"""Contour mode (CM, CD, DT) on the machine."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.record import AxisStatus
from tests.unit.dmc41x3.twin.bench import Bench

SAMPLE = 1 / 1024


def contouring(*records: str, axes: str = "AB", interval: int = 5) -> Bench:
    """Return a bench that has begun a contour at time 0."""
    bench = Bench()
    bench.do(f"CM {axes}", "DT -1", *(f"CD {record}" for record in records), f"DT {interval}")
    return bench


def references(bench: Bench, t: float) -> list[float]:
    """Return the references of all axes at a time, not rounded [counts]."""
    bench.at(t)
    return [bench.axis(index).timeline.at(t)[0] for index in range(3)]


def test_each_record_takes_its_interval_at_constant_speed() -> None:
    bench = contouring("32,-64", "96,0", "0,0=0")
    assert bench.say("SC") == " 50, 50, 1\r\n:"
    # 32 samples are 1/32 s: 1024 and -2048 counts/s.
    assert references(bench, 0.5 / 32) == [16.0, -32.0, 0.0]
    assert (bench.axis(0).timeline.at(bench.now)[1], bench.axis(1).timeline.at(bench.now)[1]) == (1024.0, -2048.0)
    assert references(bench, 1.5 / 32) == [80.0, -64.0, 0.0]
    assert bench.value("_BGA") == 1.0
    bench.at(2 / 32)
    assert bench.value("_BGA") == 0.0
    assert bench.say("SC") == " 51, 51, 1\r\n:"
    assert bench.positions() == [128, -64, 0]
    assert bench.say("TC") == " 0\r\n:"


def test_a_contour_begins_with_its_first_record() -> None:
    bench = Bench()
    bench.do("CM C", "DT 8")
    assert bench.value("_BGC") == 0.0
    bench.do("CD ,,512")
    assert bench.value("_BGC") == 1.0
    assert references(bench, 0.125) == [0.0, 0.0, 256.0]


def test_cd_may_bring_its_own_interval_and_it_stays() -> None:
    bench = Bench()
    bench.do("CM A", "CD 100=4", "CD 100", "CD 100=1", "CD 0=0")
    assert bench.at(34 * SAMPLE - 1e-6).value("_BGA") == 1.0
    assert bench.at(34 * SAMPLE).value("_BGA") == 0.0
    assert bench.positions()[0] == 300


def test_cd_with_a_time_does_not_end_a_pause() -> None:
    bench = Bench()
    bench.do("CM A", "DT -1", "CD 100=4", "CD 100", "CD 0=0")
    assert bench.at(1.0).value("_BGA") == 0.0
    bench.do("DT 8")
    assert bench.at(1.0 + 31 * SAMPLE).value("_BGA") == 1.0
    assert bench.at(1.0 + 33 * SAMPLE).value("_BGA") == 0.0
    assert bench.positions()[0] == 200


def test_the_end_leaves_the_mode() -> None:
    bench = contouring("1", "0=0", axes="A").at(1.0)
    assert bench.code("CD 1") == ErrorCode.NO_SEQUENCE
    bench.do("CM A", "CD 0=0")
    assert bench.code("CD 1") == ErrorCode.NO_SEQUENCE


def test_late_data_find_the_axes_at_rest() -> None:
    bench = contouring("32", "32", axes="A")
    assert bench.at(2 / 32 - 1e-6).say("TC") == " 0\r\n:"
    assert bench.at(0.5).say("TC1") == "42 Contour data being sent too slowly\r\n:"
    assert bench.say("SCA") == " 51\r\n:"
    assert bench.positions()[0] == 64
    bench.do("CD 32", "CD 0=0")
    assert bench.say("SCA") == " 50\r\n:"
    assert bench.at(0.6).positions()[0] == 96


def test_buffer_and_record_show_the_progress() -> None:
    bench = contouring("32,0", "32,0", "32,0", "0,0=0")
    record = bench.record()
    assert (bench.value("_CM"), record.contour_free, record.contour_segment) == (508.0, 508, 0)
    assert record.axes[0].status & (AxisStatus.MOVING | AxisStatus.CONTOUR | AxisStatus.COORDINATED) == 0x8040
    bench.at(1.5 / 32)
    assert (bench.value("_CM"), bench.record().contour_segment) == (509.0, 1)
    bench.at(1.0)
    assert (bench.value("_CM"), bench.record().contour_segment) == (511.0, 4)
    assert not bench.record().axes[0].status & AxisStatus.CONTOUR
    assert bench.say("CM ?") == " 511\r\n:"


def test_tb_shows_a_contour() -> None:
    bench = contouring("32", axes="A")
    assert int(bench.say("TB")[:-3]) & 0x20
    assert not int(bench.at(1.0).say("TB")[:-3]) & 0x20


def test_the_buffer_holds_511_records() -> None:
    bench = Bench()
    bench.do("CM A", "DT -1", *["CD 1"] * 511)
    assert bench.code("CD 1") == ErrorCode.SEGMENT_BUFFER_FULL
    bench.do("DT 1")
    bench.at(2.5 * SAMPLE).do("CD 1")
    assert bench.at(9.0).positions()[0] == 512


def test_dt_minus_one_pauses_at_the_end_of_the_record_under_way() -> None:
    bench = contouring("32", "64", "96", "0=0", axes="A")
    bench.at(0.5 / 32).do("DT -1")
    assert references(bench, 3.0)[0] == 32.0
    assert (bench.value("_BGA"), bench.value("_SCA"), bench.value("_CM")) == (1.0, 50.0, 508.0)
    bench.do("CD 5", "DT 5")
    assert references(bench, 3.0 + 0.5 / 32)[0] == 64.0
    bench.at(9.0)
    assert (bench.positions()[0], bench.value("_SCA")) == (192, 51.0)


def test_a_pause_behind_the_last_record_waits_for_more() -> None:
    bench = contouring("32", axes="A")
    bench.do("DT -1")
    assert bench.at(5.0).say("TC") == " 0\r\n:"
    bench.do("CD 32", "CD 0=0", "DT 5")
    assert bench.at(6.0).positions()[0] == 64


def test_a_stop_leaves_the_contour_and_brakes_at_dc() -> None:
    bench = contouring("3200,320", "3200,320", "3200,320")
    bench.do("DC 1024000,1024000")
    bench.at(1.5 / 32).do("STA")
    assert bench.say("SC") == " 4, 4, 1\r\n:"
    # 102 400 counts/s take 0.1 s and 5120 counts; 10 240 counts/s a tenth and a hundredth of that.
    assert bench.at(1.5 / 32 + 0.099).value("_BGA") == 1.0
    assert bench.at(1.5 / 32 + 0.101).value("_BGA") == 0.0
    assert bench.positions() == [4800 + 5120, 480 + 51, 0]
    assert bench.code("CD 1") == ErrorCode.NO_SEQUENCE
    assert bench.say("TC") == " 0\r\n:"


def test_a_limit_of_one_axis_stops_them_all() -> None:
    bench = contouring("3200,320", "3200,320", "3200,320")
    bench.do("SD ,2048000")
    bench.at(1.5 / 32)
    bench.switch(1, forward=False)
    assert bench.say("SC") == " 4, 2, 1\r\n:"
    bench.at(9.0)
    # A at DC 256 000, B at SD.
    assert bench.positions() == [4800 + 20_480, 480 + 26, 0]
    assert bench.say("SC") == " 4, 2, 1\r\n:"


def test_a_soft_limit_stops_a_contour() -> None:
    bench = contouring("320", "320", "320", axes="A")
    bench.do("FLA=400", "SDA=1024000")
    bench.at(9.0)
    assert bench.value("_SCA") == 2.0
    # Braking from 10 240 counts/s takes 51 counts.
    assert bench.positions()[0] == 401 + 51


def test_an_error_of_one_axis_stops_the_others() -> None:
    bench = contouring(*["320,320"] * 100)
    bench.do("OEA=1;ERA=500")
    bench.at(0.5)
    bench.plant.hold(0)
    bench.at(0.6)
    assert bench.say("SC") == " 8, 4, 1\r\n:"
    assert (bench.value("_MOA"), bench.value("_MOB")) == (1.0, 0.0)
    assert bench.at(9.0).value("_BGB") == 0.0


def test_abort_ends_a_contour_at_once() -> None:
    bench = contouring("320", "320", axes="A").at(0.5 / 32)
    bench.do("AB1")
    assert bench.positions()[0] == 160
    assert bench.say("SCA") == " 7\r\n:"
    assert bench.say("TC") == " 0\r\n:"
    assert bench.at(1.0).positions()[0] == 160


@pytest.mark.parametrize(
    ("setup", "command", "code"),
    [
        ("", "CD 1", ErrorCode.NO_SEQUENCE),
        ("CM A", "CD 1", ErrorCode.NO_TIME),
        ("CM A;DT 2", "CD 32769", ErrorCode.CONTOUR_RANGE),
        ("CM A;DT 2", "CD -32769", ErrorCode.CONTOUR_RANGE),
        ("CM A;DT 2", "CD 1,1", ErrorCode.OPERAND_ERROR),
        ("CM A;DT 2", "CD 1=9", ErrorCode.OUT_OF_RANGE),
        ("CM A;DT 2", "CD 1=-2", ErrorCode.OUT_OF_RANGE),
        ("CM A;DT 2", "CD 1=0", ErrorCode.NO_TIME),
        ("CM A;DT 2", "CD 1=2=3", ErrorCode.OPERAND_ERROR),
        ("CM A;DT 2", "CD", ErrorCode.NOT_ENOUGH_FIELDS),
        ("CM A;DT 2", "CD ?", ErrorCode.QUESTION_MARK_INVALID),
        ("", "DT 9", ErrorCode.OUT_OF_RANGE),
        ("", "DT -2", ErrorCode.OUT_OF_RANGE),
        ("", "CM D", ErrorCode.INVALID_AXIS),
        ("MOA;CM A;DT 2", "CD 1", ErrorCode.BEGIN_MOTOR_OFF),
        ("CM A;DT 2;JGA=100;BGA", "CD 1", ErrorCode.BEGIN_WHILE_RUNNING),
        ("FLA=-5;CM A;DT 2", "CD 1", ErrorCode.BEGIN_AT_LIMIT),
        ("VM AB;VP 9999,0;VE;BGS", "CM A", ErrorCode.NOT_IN_COORDINATED_MOVE),
    ],
)
def test_misuse_has_its_code(setup: str, command: str, code: ErrorCode) -> None:
    bench = Bench()
    bench.do(*[setup] * bool(setup))
    assert bench.code(command) == code


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("CM A", ErrorCode.NOT_WHILE_CONTOURING),
        ("DT 0", ErrorCode.NOT_WHILE_CONTOURING),
        ("BGA", ErrorCode.NOT_WHILE_CONTOURING),
        ("PVA=1,0,2;BTA", ErrorCode.NOT_WHILE_CONTOURING),
        ("PAA=5", ErrorCode.NOT_WHILE_RUNNING),
        ("MOB", ErrorCode.NOT_WHILE_RUNNING),
        ("DPA=0", ErrorCode.NOT_WHILE_RUNNING),
    ],
)
def test_running_contour_refuses_commands(command: str, code: ErrorCode) -> None:
    bench = contouring("320,0", "320,0").at(0.5 / 32)
    *before, last = command.split(";")
    bench.do(*before)
    assert bench.code(last) == code


def test_a_refused_record_is_forgotten() -> None:
    bench = Bench()
    bench.do("MOA", "CM A", "DT 2")
    assert bench.code("CD 100") == ErrorCode.BEGIN_MOTOR_OFF
    bench.do("SHA", "CD 1", "CD 0=0")
    assert bench.at(1.0).positions()[0] == 1


def test_cd0_without_a_space_is_a_variable() -> None:
    bench = contouring("32", axes="A")
    bench.do("CD0=0")
    assert bench.value("CD0") == 0.0
    assert bench.value("_CM") == 510.0


def test_other_axes_continue_while_one_contours() -> None:
    bench = contouring("32,0", "0,0=0")
    bench.do("PRC=1000;BGC")
    assert bench.at(2.0).positions() == [32, 0, 1000]


def test_a_reset_forgets_the_contour() -> None:
    bench = contouring("320", "320", axes="A").at(0.01)
    bench.machine.unit.reset()
    assert bench.value("_CM") == 511.0
    assert bench.say("DT ?") == " 0\r\n:"
    assert bench.code("CD 1") == ErrorCode.NO_SEQUENCE


@given(
    st.lists(
        st.tuples(st.integers(-32_768, 32_768), st.integers(-32_768, 32_768), st.integers(1, 8)),
        min_size=1,
        max_size=40,
    ),
    st.floats(0.0, 1.0),
)
def test_sums_are_exact_at_the_end_of_every_record(records: list[tuple[int, int, int]], share: float) -> None:
    bench = Bench()
    bench.do("CM AC", "DT -1", *(f"CD {a},,{c}={n}" for a, c, n in records), "CD 0=0", f"DT {records[-1][2]}")
    end, sums = 0.0, (0, 0)
    ends: list[tuple[float, tuple[int, int]]] = []
    for a, c, n in records:
        end += 2**n * SAMPLE
        sums = (sums[0] + a, sums[1] + c)
        ends.append((end, sums))
    for t, (a, c) in ends[:: max(1, round(len(ends) * share))]:
        x, y, z = references(bench, t)
        assert (x, y, z) == pytest.approx((a, 0.0, c), abs=1e-6)
    assert bench.at(end).positions() == [sums[0], 0, sums[1]]
    assert bench.value("_SCA") == 51.0


def test_pause_keeps_the_end_of_earlier_motion() -> None:
    bench = contouring("32", "64", "0=0", "999", axes="A")
    bench.at(0.5 / 32).do("DT -1")
    bench.at(1.0).do("DT 5")
    bench.at(2.0)
    assert (bench.positions()[0], bench.value("_SCA")) == (96, 51.0)


@pytest.mark.parametrize("wait", ["AMA", "MCA"])
def test_a_program_waits_for_the_end_of_a_contour(wait: str) -> None:
    bench = Bench()
    bench.raw(f"DL\r#GO\rCM A;DT 5;CD 32;CD 32;CD 0=0\r{wait};x=TIME\rEN\r\\")
    bench.do("XQ #GO")
    bench.at(1.0)
    assert bench.value("x") == pytest.approx(2 * 32, abs=8)
