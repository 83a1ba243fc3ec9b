from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


def moving_to(target: int = 100_000, **registers: int) -> Bench:
    bench = Bench()
    bench.do(*(f"{name}A={value}" for name, value in ({"SP": 10_240, "AC": 10_240, "DC": 10_240} | registers).items()))
    bench.do(f"PAA={target}", "BGA")
    return bench


def test_a_move_ends_exactly_and_reports_it() -> None:
    bench = moving_to(102_400)
    bench.at(5.0)
    assert bench.value("_SCA") == 0.0
    assert bench.value("_BGA") == 1.0
    bench.at(10.5)  # decelerating: 10 s of slewing distance and 1 s for the ramps
    assert (bench.value("_SCA"), bench.value("_BGA")) == (1.0, 1.0)
    bench.at(11.0)
    assert (bench.value("_SCA"), bench.value("_BGA")) == (1.0, 0.0)
    assert bench.value("_TPA") == bench.value("_PAA") == 102_400.0


def test_pa_operand_is_the_last_place_of_rest_not_the_target() -> None:
    bench = moving_to(50_000).at(2.0)
    assert bench.value("_PAA") == 0.0
    assert bench.say("PA ?") == " 0\r\n:"


def test_pr_repeats_and_pa_does_not() -> None:
    bench = Bench()
    bench.do("PRA=1000;BGA")
    bench.at(5.0).do("BGA")
    assert bench.at(10.0).value("_RPA") == 2000.0
    bench.do("PAA=500;BGA")
    bench.at(20.0).do("BGA")
    assert bench.value("_BGA") == 1.0  # even a move of no counts takes a sample
    assert bench.at(30.0).value("_RPA") == 500.0


def test_positions_survive_dp() -> None:
    bench = Bench()
    bench.do("PRA=1000;BGA")
    bench.at(5.0).do("DPA=-70")
    bench.do("PRA=100;BGA")
    assert bench.at(9.0).positions()[0] == 30
    bench.do("PAA=0;BGA")
    assert bench.at(15.0).positions()[0] == 0
    assert bench.plant.position(0) == 1070


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("PAA=0", ErrorCode.NOT_WHILE_RUNNING),
        ("PRA=1", ErrorCode.NOT_WHILE_RUNNING),
        ("DCA=2048", ErrorCode.NOT_WHILE_RUNNING),
        ("SDA=2048", ErrorCode.NOT_WHILE_RUNNING),
        ("MOA", ErrorCode.NOT_WHILE_RUNNING),
        ("SHA", ErrorCode.NOT_WHILE_RUNNING),
        ("DPA=0", ErrorCode.NOT_WHILE_RUNNING),
        ("PTA=1", ErrorCode.NOT_WHILE_RUNNING),
        ("HMA", ErrorCode.NOT_WHILE_RUNNING),
        ("FEA", ErrorCode.NOT_WHILE_RUNNING),
        ("FIA", ErrorCode.NOT_WHILE_RUNNING),
        ("MTA=1", ErrorCode.NOT_WHILE_RUNNING),
        ("CEA=1", ErrorCode.NOT_WHILE_RUNNING),
        ("TM 1000", ErrorCode.NOT_WHILE_RUNNING),
        ("BGA", ErrorCode.BEGIN_WHILE_RUNNING),
        ("JGA=100", ErrorCode.JOG_ONLY_IN_JOG_MODE),
        ("IPA=-5", ErrorCode.IP_WRONG_SIGN),
    ],
)
def test_moving_axis_refuses_commands(command: str, code: ErrorCode) -> None:
    bench = moving_to().at(1.5)
    assert bench.code(command) == code


@pytest.mark.parametrize(
    "command",
    ["SPA=20480", "ACA=2048", "IPA=500", "DEA=1", "FLA=9", "BLA=-9", "ERA=9", "OEA=1", "LDA=3", "TLA=5", "KPA=9",
     "ITA=1", "HVA=4", "BWA=10", "ZAA=5", "STA", "CN-1", "PAB=5", "PRB=5", "BGB", "SHB", "MOC", "DPB=4", "VD2048"],
)  # fmt: skip
def test_moving_axis_or_its_neighbour_accepts_commands(command: str) -> None:
    moving_to().at(1.5).do(command)


@pytest.mark.parametrize("command", ["DCA=2048", "SDA=2048", "JGA=-1000", "SPA=2000", "IPA=-100"])
def test_jogging_axis_accepts_commands(command: str) -> None:
    bench = Bench()
    bench.do("JGA=1000;BGA")
    bench.at(1.0).do(command)


def test_dc_is_accepted_while_a_move_is_being_stopped() -> None:
    bench = moving_to().at(2.0)
    bench.do("STA", "DCA=20480")
    assert bench.at(2.5).value("_BGA") == 0.0
    assert bench.positions()[0] == 5120 + 10240 + 2560


def test_speed_on_the_way() -> None:
    bench = moving_to(102_400).at(2.0)
    bench.do("SPA=20480")
    assert bench.at(3.0).axis(0).timeline.at(3.0)[1] == 20480.0
    assert bench.at(3.25).value("_TVA") == 20480.0
    assert bench.at(30.0).positions()[0] == 102_400


def test_stop_decelerates_at_dc_and_answers_at_once() -> None:
    bench = moving_to().at(2.0)
    bench.do("STA")
    assert (bench.value("_SCA"), bench.value("_BGA")) == (4.0, 1.0)
    assert bench.record().axes[0].stopping
    bench.at(2.5).do("STA")
    bench.at(3.0)
    assert (bench.value("_SCA"), bench.value("_BGA")) == (4.0, 0.0)
    assert bench.positions()[0] == 5120 + 10240 + 5120


def test_a_bare_stop_stops_everything() -> None:
    bench = Bench()
    bench.do("JG 1000,2000;BGAB", "ST")
    assert bench.at(1.0).say("SC") == " 4, 4, 1\r\n:"


def test_abort_stops_at_once_and_leaves_the_servo_on_without_oe() -> None:
    bench = moving_to().at(2.0)
    bench.do("OEB=1", "AB 1")
    assert bench.positions()[0] == 15360
    assert (bench.value("_BGA"), bench.value("_SCA")) == (0.0, 7.0)
    assert (bench.value("_MOA"), bench.value("_MOB")) == (0.0, 1.0)


def test_begin_is_all_or_nothing() -> None:
    bench = Bench()
    bench.do("MOB", "PR 100,100")
    assert bench.code("BGAB") == ErrorCode.BEGIN_MOTOR_OFF
    assert bench.value("_BGA") == 0.0


def test_jog_changes_and_reverses() -> None:
    bench = Bench()
    bench.do("AC*=10240;DC*=10240", "JGA=10240;BGA")
    bench.at(2.0).do("JGA=-5120")
    assert bench.at(3.0).axis(0).timeline.at(3.0)[1] == 0.0
    assert bench.at(3.5).axis(0).timeline.at(3.5)[1] == -5120.0
    assert bench.at(3.75).value("_TVA") == -5120.0
    assert bench.value("_JGA") == bench.value("_SPA") == 5120.0
    bench.do("JGA=0")
    assert bench.at(9.0).value("_BGA") == 1.0


def test_ip_lengthens_a_move_and_steps_a_jog() -> None:
    bench = moving_to(20_480).at(1.0)
    bench.do("IPA=10240")
    assert bench.at(9.0).positions()[0] == 30_720
    bench.do("IPA=-720")
    assert bench.at(12.0).positions()[0] == 30_000
    bench.do("JGA=1024;ACA=1024;BGA")
    before = bench.at(14.0).positions()[0]
    bench.do("IPA=-50")
    assert bench.positions()[0] == before - 50


def test_position_tracking_follows_without_bg() -> None:
    bench = Bench()
    bench.do("PTA=1", "PAA=5000")
    bench.at(0.3).do("PAA=-5000")
    assert bench.at(5.0).positions()[0] == -5000
    bench.do("STA")
    assert bench.value("_PTA") == 0.0


def test_servo_on_takes_the_position_of_the_shaft() -> None:
    bench = moving_to().at(1.0)
    bench.plant.hold(0)
    bench.at(2.0).do("AB 1")
    assert bench.value("_TEA") == 10240.0
    bench.do("SHA")
    assert bench.value("_TEA") == 0.0
    assert bench.positions()[0] == 5120


def test_record_shows_the_phase_of_a_move() -> None:
    bench = moving_to(-102_400)
    up, slew, down = (bench.at(t).record().axes[0].status for t in (0.5, 5.0, 10.5))
    assert up == 0b1110_0000_1000_0000
    assert slew == 0b1110_0000_1010_0000
    assert down == 0b1110_0000_1000_1000
    assert bench.at(20.0).record().axes[0].status == 0


def test_the_record_agrees_with_the_operands() -> None:
    bench = moving_to().at(2.25)
    bench.do("SB 3;ZAA=-5;MOC")
    record = bench.record()
    axis = record.axes[0]
    assert axis.position == axis.reference == bench.value("_TPA")
    assert axis.velocity == bench.value("_TVA") == 10240.0
    assert axis.user == -5
    assert record.sample == bench.value("TIME") == 2304
    assert record.handles == (2, 0, 0, 0, 0, 0, 0, 0)
    assert record.axes[2].motor_off
    assert record.outputs[0] == 4


def test_partial_record_has_the_requested_blocks() -> None:
    bench = Bench()
    bench.do("DPB=77")
    data = bench.raw("QR BS\r")[:-1]
    assert data[0] & 7 == 1
    assert data[1] == 0b010
    assert int.from_bytes(data[2:4], "little") == len(data) == 4 + 10 + 36
    assert int.from_bytes(data[14 + 4 : 14 + 8], "little") == 77


def test_nothing_is_computed_between_events() -> None:
    bench = moving_to(102_400)
    events: list[float] = []
    while (event := bench.machine.next_event(100.0)) is not None:
        events.append(event)
        bench.at(event)
    assert events == [pytest.approx(11.0)]
