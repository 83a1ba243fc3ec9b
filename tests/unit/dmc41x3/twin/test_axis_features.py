"""Functions of an axis besides moves: homing in its stages, smoothing, brakes, latches, failures."""

from __future__ import annotations

from math import isclose

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.record import AxisStatus, AxisSwitches
from tests.unit.dmc41x3.twin.bench import Bench

ROUND = "AC*=10240;DC*=10240;SD*=10240;SP*=10240;HV*=1024"
STAGES = (
    AxisStatus.FINDING_EDGE
    | AxisStatus.HOMING
    | AxisStatus.HOMING_FIRST_DONE
    | AxisStatus.HOMING_SECOND_DONE
    | AxisStatus.HOMING_THIRD
)


def stages(bench: Bench) -> int:
    """Return the bits of axis A that tell how far a homing is."""
    return bench.record().axes[0].status & STAGES


def test_fi_passes_the_index_brakes_and_returns() -> None:
    bench = Bench()
    bench.do(ROUND, "DPA=77", "JGA=2048", "FIA;BGA")
    assert stages(bench) == AxisStatus.HOMING_SECOND_DONE
    # 0.2 s to speed over 204.8 counts, then 3795.2 counts to the index at 4000, then 204.8 to rest.
    at_index = 0.2 + 3795.2 / 2048
    bench.at(at_index + 0.2)
    assert bench.axis(0).timeline.at(bench.now)[0] == pytest.approx(4204.8, abs=0.5)
    assert bench.at(at_index + 1.0).value("_SCA") == 10.0
    assert (bench.positions()[0], bench.plant.position(0)) == (0, 4000.0)


def test_hm_reports_its_stages() -> None:
    bench = Bench()
    bench.do(ROUND, "HMA;BGA")
    assert stages(bench) == AxisStatus.HOMING
    bench.at(2.0)
    bench.switch(0, home=False)
    assert stages(bench) == AxisStatus.HOMING
    bench.at(3.5)
    assert stages(bench) == AxisStatus.HOMING | AxisStatus.HOMING_FIRST_DONE
    bench.switch(0, home=True)
    third = AxisStatus.HOMING | AxisStatus.HOMING_FIRST_DONE | AxisStatus.HOMING_SECOND_DONE | AxisStatus.HOMING_THIRD
    assert stages(bench) == third
    assert bench.record().axes[0].status & AxisStatus.NEGATIVE == 0
    assert bench.at(60.0).value("_SCA") == 10.0
    assert bench.positions()[0] == 0
    assert bench.plant.position(0) % 4000 == 0


def test_the_second_stage_of_hm_stops_at_once() -> None:
    bench = Bench()
    bench.do(ROUND, "HMA;BGA")
    bench.at(2.0)
    bench.switch(0, home=False)
    bench.at(4.0)
    before = bench.axis(0).timeline.at(4.0)[0]
    bench.switch(0, home=True)
    assert bench.axis(0).timeline.at(4.0) == (round(before), 0.0)


def test_a_stepper_s_homing_ends_at_the_second_edge() -> None:
    bench = Bench(servo=False)
    bench.do("MTA=2", "SH", ROUND, "HMA;BGA")
    bench.at(2.0)
    bench.switch(0, home=False)
    bench.at(4.0)
    bench.switch(0, home=True)
    assert bench.at(4.01).value("_SCA") == 10.0
    assert bench.positions()[0] == 0
    assert bench.plant.position(0) % 4000 != 0


def test_a_stop_during_the_way_to_the_index_ends_there() -> None:
    bench = Bench()
    bench.do(ROUND, "JGA=2048", "FIA;BGA")
    bench.at(1.0).do("STA")
    assert bench.at(5.0).value("_SCA") == 4.0
    assert bench.positions()[0] != 0


@given(
    smoothness=st.integers(1, 255).map(lambda raw: raw / 256),
    target=st.integers(-30_000, 30_000),
    turn=st.floats(0.01, 1.0),
)
def test_smoothing_ends_at_the_same_place_later_and_without_a_step(smoothness: float, target: int, turn: float) -> None:
    bench = Bench()
    bench.do(ROUND, f"ITA={smoothness:.5f}", f"PRA={target};BGA")
    timeline = bench.axis(0).timeline
    before = bench.at(turn).axis(0).timeline.at(turn)
    bench.do("SPA=20480")
    after = timeline.at(turn)
    assert isclose(before[0], after[0], abs_tol=1e-3)
    assert isclose(before[1], after[1], abs_tol=1e-3)
    assert bench.at(60.0).positions()[0] == target
    for piece, following in zip(timeline.pieces, timeline.pieces[1:], strict=False):
        there = piece.at(following.t)
        assert isclose(there[0], following.p, abs_tol=0.6)
        assert isclose(there[1], following.v, abs_tol=1.0)


def test_smoothing_makes_a_move_longer_by_twice_its_delay() -> None:
    bench = Bench()
    bench.do(ROUND, "ITA=0.25", "PRA=10240;BGA")
    longer = 2 * 3 / 1024
    assert bench.at(2.0 + longer - 1e-4).value("_BGA") == 1.0
    assert bench.at(2.0 + longer + 1e-4).value("_BGA") == 0.0


def test_a_stop_is_smoothed_too() -> None:
    bench = Bench()
    bench.do(ROUND, "ITA=0.0625", "JGA=10240;BGA")
    bench.at(3.0).do("STA")
    delay = 15 / 1024
    assert bench.at(9.0).positions()[0] == pytest.approx(10_240 * (3.0 - 0.5 - delay) + 10_240 * delay + 5_120, abs=1)


def test_tv_is_the_mean_of_a_quarter_of_a_second() -> None:
    bench = Bench()
    bench.do(ROUND, "JGA=10240;BGA")
    assert bench.at(0.25).value("_TVA") == pytest.approx(0.5 * 10_240 * 0.25**2 / 0.25, abs=1)
    assert bench.at(1.0).value("_TVA") == pytest.approx(10_240 - 0.5 * 10_240 * 0.25, abs=1)
    assert bench.at(1.25).value("_TVA") == 10_240.0
    bench.do("AB 1")
    assert bench.at(1.375).value("_TVA") == pytest.approx(5_120, abs=1)
    assert bench.at(1.5).value("_TVA") == 0.0


def test_tv_shows_a_held_shaft_at_rest() -> None:
    bench = Bench()
    bench.do(ROUND, "JGA=10240;BGA")
    bench.at(2.0).plant.hold(0)
    assert bench.at(3.0).value("_TVA") == 0.0


def test_tv_does_not_take_sh_for_motion() -> None:
    bench = Bench()
    bench.do("JGA=10240;BGA")
    bench.at(1.0).plant.hold(0)
    bench.at(2.0).do("AB 1", "SHA")
    assert bench.at(2.1).value("_TVA") == 0.0


def test_a_brake_falls_at_once_and_the_amplifier_goes_later() -> None:
    bench = Bench()
    bench.do("BWA=512")
    bench.do("SHA")
    assert bench.plant.outputs[1] is True
    bench.at(1.0).do("MOA")
    assert (bench.value("_MOA"), bench.plant.outputs[1], bench.plant.powered[0]) == (1.0, False, True)
    bench.at(1.0 + 511 / 1024)
    assert bench.plant.powered[0] is True
    bench.at(1.0 + 512 / 1024 + 1e-6)
    assert bench.plant.powered[0] is False
    bench.do("SHA")
    assert (bench.plant.outputs[1], bench.plant.powered[0]) == (True, True)


def test_a_servo_switched_on_before_its_amplifier_went_stays_on() -> None:
    bench = Bench()
    bench.do("BWA=512", "SHA", "MOA")
    bench.at(0.1).do("SHA")
    assert bench.at(2.0).plant.powered[0] is True


def test_a_fault_drops_brake_and_amplifier_together() -> None:
    bench = Bench()
    bench.do("BWA=512", "SHA", "OEA=1", "JGA=1000;BGA")
    bench.at(1.0).do("AB 1")
    assert (bench.plant.outputs[1], bench.plant.powered[0]) == (False, False)


def test_the_output_of_a_brake_is_not_for_others() -> None:
    bench = Bench()
    bench.do("BWA=5", "SHA", "CB 1")
    assert bench.plant.outputs[1] is True
    bench.do("BWA=0", "SB 1", "CB 1")
    assert bench.plant.outputs[1] is False


@pytest.mark.parametrize(("cn", "first", "tripped"), [(-1, False, True), (1, False, False)])
def test_an_input_latches_on_its_edge(cn: int, first: bool, tripped: bool) -> None:
    bench = Bench()
    bench.do(f"CN ,,{cn}", ROUND, "ALB", "JGB=10240;BGB")
    bench.at(2.0).machine.unit.set_input(2, first)
    bench.machine.look()
    bench.at(3.0)
    assert bench.value("_ALB") == (not tripped)
    assert bool(bench.record().axes[1].switches & AxisSwitches.LATCHED) is tripped
    if not tripped:
        bench.machine.unit.set_input(2, True)
        bench.machine.look()
    assert bench.value("_RLB") == (15_360 if tripped else 25_600)
    assert bench.value("_ALB") == 0.0
    assert bool(bench.record().axes[1].switches & AxisSwitches.LATCH_INPUT) is not tripped


def test_another_axis_input_does_not_latch() -> None:
    bench = Bench()
    bench.do("ALA")
    bench.machine.unit.set_input(2, False)
    bench.machine.look()
    assert bench.value("_ALA") == 1.0


def test_axes_from_e_on_latch_by_inputs_from_9_on() -> None:
    bench = Bench(axes=8)
    bench.do("ALEH", "DPH=55")
    bench.machine.unit.set_input(12, False)
    bench.machine.look()
    assert (bench.value("_ALE"), bench.value("_ALH"), bench.value("_RLH")) == (1.0, 0.0, 55.0)


@pytest.mark.parametrize(("speed", "place"), [(2000, 4700), (-2000, -3300)])
def test_index_latches_exactly_at_its_position(speed: int, place: int) -> None:
    bench = Bench()
    bench.do("DPA=700", "ALTA", f"JGA={speed};BGA")
    assert bench.at(1.0).value("_ALA") == 1.0
    bench.at(2.5)
    assert (bench.value("_ALA"), bench.value("_RLA")) == (0.0, place)


def test_an_auxiliary_latch_keeps_the_auxiliary_position() -> None:
    bench = Bench()
    bench.do("DEA=-9", "ALSA")
    bench.machine.unit.set_input(1, False)
    bench.machine.look()
    assert bench.value("_RLA") == -9.0


@pytest.mark.parametrize("command", ["ALT", "ALS", "ALTS"])
def test_a_latch_needs_its_axis(command: str) -> None:
    assert Bench().code(command) == ErrorCode.OPERAND_ERROR


def test_output_compare_waits_for_a_place() -> None:
    bench = Bench()
    bench.do(ROUND, "OCA=5000,0", "PRA=10000;BGA")
    assert bench.value("_OCA") == 0.0
    assert bench.at(0.9).value("_OCA") == 0.0
    assert bench.at(1.1).value("_OCA") == 1.0
    assert bench.value("_OCB") == 1.0


def test_a_motor_that_pushes_without_its_encoder_moving_has_none() -> None:
    bench = Bench()
    bench.do("OAA=1;OTA=100;OVA=2", "JGA=10000;BGA")
    bench.at(1.0).plant.hold(0)
    assert bench.at(1.05).value("_MOA") == 0.0
    assert bench.at(1.2).value("_MOA") == 1.0
    assert (bench.value("_SCA"), bench.value("_BGA")) == (12.0, 0.0)


@pytest.mark.parametrize("setting", ["OAA=0", "OVA=6;TLA=5", "OTA=32000"])
def test_encoder_without_an_error_is_trusted(setting: str) -> None:
    bench = Bench()
    bench.do("OAA=1", "ERA=-1", setting, "JGA=10000;BGA")
    bench.at(1.0).plant.hold(0)
    assert bench.at(3.0).value("_MOA") == 0.0


@pytest.mark.parametrize(("oe", "off"), [(0, 0.0), (1, 1.0), (2, 0.0), (3, 1.0)])
def test_a_selective_abort_stops_its_axis_only(oe: int, off: float) -> None:
    bench = Bench()
    bench.do(ROUND, "CN ,,,1", f"OEA={oe}", "JG 10240,10240;BGAB")
    bench.at(2.0).machine.unit.set_input(5, False)
    bench.machine.look()
    assert (bench.value("_SCA"), bench.value("_BGA"), bench.value("_MOA")) == (11.0, 0.0, off)
    assert bench.positions()[0] == 15_360
    assert bench.value("_BGB") == 1.0


def test_without_cn_the_input_aborts_nothing() -> None:
    bench = Bench()
    bench.do("JGA=1000;BGA")
    bench.at(1.0).machine.unit.set_input(5, False)
    bench.machine.look()
    assert bench.value("_BGA") == 1.0


def test_tl_limits_tt_and_of_adds_to_it() -> None:
    bench = Bench()
    bench.do("OFA=1.5")
    assert bench.value("_TTA") == pytest.approx(1.5, abs=1e-3)
    bench.plant.hold(0)
    bench.do("PRA=1000;BGA")
    assert bench.at(1.0).value("_TTA") == pytest.approx(9.9982, abs=1e-3)
    bench.do("TLA=3")
    assert bench.value("_TTA") == pytest.approx(3.0, abs=1e-3)
    bench.do("TKA=5")
    assert bench.value("_TTA") == pytest.approx(5.0, abs=1e-3)
    bench.do("MOA")
    assert bench.value("_TTA") == 0.0


def test_er_is_printed_once_however_long_it_lasts() -> None:
    bench = Bench()
    core = bench.machine.unit.core
    bench.do("ERA=100", "JGA=1000;BGA")
    bench.at(1.0).plant.hold(0)
    core.step(2.0)
    core.advance(2.0)
    assert [happening.name for happening, _ in core.happened] == ["POSITION_ERROR"]
