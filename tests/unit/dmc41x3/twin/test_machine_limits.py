from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


class EdgeBench(Bench):
    """Axis A jogs at 10 240 counts/s; its registers are round."""

    def __init__(self, speed: int = 10_240) -> None:
        super().__init__()
        self.do("AC*=10240;DC*=10240;SD*=20480", f"JGA={speed};BGA")


def test_cn_fakes_a_limit_during_a_jog() -> None:
    bench = EdgeBench().at(2.0)
    bench.do("CN 1")
    assert bench.value("_SCA") == 2.0
    assert bench.value("_LFA") == 0.0
    assert bench.record().axes[0].forward_limit_active
    assert bench.record().axes[0].stopping
    assert bench.at(2.5).value("_BGA") == 0.0  # SD, not DC
    assert bench.positions()[0] == 15_360 + 2_560


@pytest.mark.parametrize(("speed", "code", "back"), [(10_240, 2, -100), (-10_240, 3, 100)])
def test_a_switch_stops_the_axis_and_lets_it_go_back(speed: int, code: int, back: int) -> None:
    bench = EdgeBench(speed).at(2.0)
    bench.switch(0, forward=code != 2, reverse=code != 3)
    assert bench.at(3.0).value("_SCA") == code
    assert bench.code("BGA") == ErrorCode.BEGIN_AT_LIMIT
    bench.do(f"PRA={back};BGA")
    assert bench.at(5.0).value("_SCA") == 1.0


def test_an_active_switch_behind_does_not_matter() -> None:
    bench = EdgeBench()
    bench.switch(0, reverse=False)
    assert bench.at(2.0).value("_SCA") == 0.0


def test_ld_disables_switches_and_not_soft_limits() -> None:
    bench = EdgeBench()
    bench.do("LDA=1;FLA=20000")
    bench.switch(0, forward=False)
    assert bench.at(1.5).value("_SCA") == 0.0
    assert bench.at(9.0).value("_SCA") == 2.0


def test_a_soft_limit_is_overshot_and_then_closed_outwards() -> None:
    bench = Bench()
    bench.do("AC*=10240;DC*=10240;SD*=10240", "FLA=15359;BLA=-1000", "JGA=10240;BGA")
    assert bench.at(2.0).value("_SCA") == 2.0
    assert bench.at(4.0).positions()[0] == 15_360 + 5_120
    assert bench.code("BGA") == ErrorCode.BEGIN_AT_LIMIT
    bench.do("PAA=0;BGA")
    assert bench.at(9.0).value("_SCA") == 1.0


def test_a_soft_limit_set_on_the_way_counts() -> None:
    bench = EdgeBench().at(1.0)
    bench.do("FLA=10000")
    assert bench.at(3.0).value("_SCA") == 2.0


def test_oe_2_switches_the_motor_off_at_a_limit() -> None:
    bench = EdgeBench().at(1.0)
    bench.do("OEA=2")
    bench.switch(0, forward=False)
    bench.at(1.5)
    assert (bench.value("_MOA"), bench.value("_SCA"), bench.value("_BGA")) == (1.0, 2.0, 0.0)


def test_a_blocked_axis_loses_its_motor_when_the_error_exceeds_er() -> None:
    bench = EdgeBench().at(1.0)
    bench.do("ERA=1000;OEA=1")
    bench.plant.hold(0)
    bench.at(1.09)
    assert bench.value("_MOA") == 0.0
    bench.at(1.11)
    assert (bench.value("_MOA"), bench.value("_SCA"), bench.value("_BGA")) == (1.0, 8.0, 0.0)
    assert not bench.plant.powered[0]
    assert 1000 < bench.value("_TEA") < 1030
    bench.do("SHA")
    assert bench.value("_TEA") == 0.0


def test_without_oe_an_error_only_shows() -> None:
    bench = EdgeBench().at(1.0)
    bench.do("ERA=1000")
    bench.plant.hold(0)
    assert int(bench.at(1.5).value("_TSA")) & 64
    assert bench.value("_MOA") == 0.0
    bench.do("ERA=-1")
    assert not int(bench.value("_TSA")) & 64


def test_the_abort_input_stops_all_and_switches_off_those_with_oe() -> None:
    bench = EdgeBench().at(2.0)
    bench.do("OEA=1")
    bench.machine.abort_input(True)
    assert bench.say("SC") == " 6, 6, 6\r\n:"
    assert (bench.value("_MOA"), bench.value("_MOB"), bench.value("_AB")) == (1.0, 0.0, 0.0)
    bench.do("PRB=100;BGB")
    assert bench.value("_BGB") == 0.0
    bench.machine.abort_input(False)
    bench.do("BGB")
    assert bench.value("_AB") == 1.0
    assert bench.at(4.0).value("_SCB") == 1.0


def test_an_amplifier_fault_switches_off_the_axes_with_oe() -> None:
    bench = EdgeBench().at(2.0)
    bench.do("OEA=1")
    bench.machine.amplifier_fault(0x01000000)
    assert (bench.value("_SCA"), bench.value("_MOA"), bench.value("_MOB")) == (15.0, 1.0, 0.0)
    assert bench.value("_TA0") == 1.0
    assert bench.say("TA 0") == " 1\r\n:"
    assert bench.record().amplifier_status == 0x01000000
    bench.machine.amplifier_fault(0)
    bench.do("SHA")
    assert bench.value("_MOA") == 0.0


@pytest.mark.parametrize(("cn", "level", "state", "direction"), [(-1, True, 1, -1), (-1, False, 0, 1), (1, True, 0, 1)])
def test_home_input_decides_the_direction_of_a_search(cn: int, level: bool, state: int, direction: int) -> None:
    bench = Bench()
    bench.do(f"CN ,{cn}", "SPA=2048")
    bench.switch(0, home=level)
    assert bench.value("_HMA") == state
    bench.do("FEA;BGA")
    bench.at(1.0)
    assert bench.positions()[0] * direction > 0
    bench.switch(0, home=not level)
    assert bench.at(3.0).value("_SCA") == 9.0


def test_hm_finds_the_edge_again_slowly_and_then_the_index() -> None:
    bench = Bench()
    bench.do("DPA=555", "SPA=4096;HVA=1024", "HMA;BGA")
    bench.at(3.0)
    assert bench.record().axes[0].status & 0x0800
    bench.switch(0, home=False)
    bench.at(4.0)
    bench.switch(0, home=True)
    bench.at(20.0)
    assert (bench.value("_SCA"), bench.value("_BGA"), bench.value("_TPA")) == (10.0, 0.0, 0.0)
    assert bench.plant.position(0) % 4000 == 0


def test_fi_makes_the_next_index_the_origin() -> None:
    bench = Bench()
    bench.do("JGA=-2048", "FIA;BGA")
    assert bench.at(9.0).value("_SCA") == 10.0
    assert bench.positions()[0] == 0
    assert bench.plant.position(0) == -4000


def test_a_limit_ends_a_homing() -> None:
    bench = Bench()
    bench.do("SPA=4096", "HMA;BGA")
    bench.at(1.0)
    bench.switch(0, reverse=False)
    assert bench.at(5.0).value("_SCA") == 3.0
    assert bench.value("_BGA") == 0.0
