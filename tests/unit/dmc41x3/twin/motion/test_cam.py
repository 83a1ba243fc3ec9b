"""The electronic cam: slaves on a table over the master's cycle."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench

QUICK = "ACA=1073740800;DCA=1073740800"


def cam(values: list[int], *, interval: int = 500, modulus: int = 0, engage: int | None = 0) -> Bench:
    """Return a bench whose axis B is on a cam over axis A; the cycle has one interval less than values."""
    bench = Bench()
    bench.do(QUICK, "EAA", f"EMA={interval * (len(values) - 1)};EMB={modulus}", f"EP {interval}")
    bench.do(*(f"ET[{index}]=,{value}" for index, value in enumerate(values)), "EB 1")
    if engage is not None:
        bench.do(f"EGB={engage}")
    return bench


def test_a_slave_is_on_straight_lines_between_the_entries() -> None:
    bench = cam([0, 100, 300, 100, 0])
    bench.do("JGA=1000;BGA")
    places = [bench.at(0.25 * step).positions()[:2] for step in range(1, 8)]
    assert [master for master, _ in places] == pytest.approx([250 * step for step in range(1, 8)], abs=1)
    assert [slave for _, slave in places] == pytest.approx([50, 100, 200, 300, 200, 100, 50], abs=1)
    assert bench.value("_SCB") == 60.0
    assert bench.value("_BGB") == 0.0


def test_the_master_s_counter_stays_within_its_cycle_and_cycles_are_counted() -> None:
    bench = cam([0, 100, 300, 100, 0])
    bench.do("JGA=1000;BGA")
    assert bench.at(5.0).positions()[0] == pytest.approx(1000, abs=1)
    assert bench.value("_EY") == 2.0
    assert bench.positions()[1] == pytest.approx(300, abs=1)
    assert bench.plant.position(0) == pytest.approx(5000, abs=1)


def test_advancing_cam_continues_when_its_counter_restarts() -> None:
    bench = cam([0, 250, 1000], interval=1000, modulus=1000)
    bench.do("JGA=1000;BGA")
    assert bench.at(5.0).positions()[1] == pytest.approx(250, abs=1)
    assert bench.plant.position(1) == pytest.approx(2250, abs=1)


def test_it_runs_backwards_too() -> None:
    bench = cam([0, 100, 300, 100, 0])
    bench.do("JGA=-1000;BGA")
    assert bench.at(0.75).positions()[:2] == pytest.approx([1250, 200], abs=1)
    assert bench.value("_EY") == -1.0


@given(
    values=st.lists(st.integers(-2000, 2000), min_size=3, max_size=9),
    targets=st.lists(st.integers(-6000, 6000), min_size=1, max_size=4),
)
def test_slave_depends_on_its_masters_position_and_not_on_its_path(values: list[int], targets: list[int]) -> None:
    values = [*values, values[0]]
    bench = cam(values, interval=100)
    cycle = 100 * (len(values) - 1)
    now = 0.0
    for target in targets:
        bench.do(f"PRA={target};SPA=5000;BGA")
        now += 1.5
        master, slave = bench.at(now).positions()[:2]
        at, rest = divmod(master % cycle, 100)
        wanted = values[at] + (values[at + 1] - values[at]) * rest / 100
        assert abs(slave - wanted) <= 1.0


def test_an_axis_engages_at_its_place_and_disengages_at_another() -> None:
    bench = cam([0, 100, 200, 100, 0], engage=None)
    bench.do("EGB=500", "JGA=1000;BGA")
    assert bench.value("_EQB") == 1.0
    assert bench.at(0.4).value("_EGB") == 0.0
    assert bench.at(0.75).positions()[1] == pytest.approx(150, abs=1)
    assert bench.value("_EGB") == 1.0
    bench.do("EQB=1250")
    assert bench.value("_EQB") == 2.0
    assert bench.at(3.0).positions()[1] == pytest.approx(150, abs=1)
    assert (bench.value("_EGB"), bench.value("_EQB"), bench.value("_SCB")) == (0.0, 0.0, 61.0)
    assert bench.plant.position(1) == pytest.approx(50, abs=1)


def test_a_place_outside_the_cycle_means_now() -> None:
    bench = cam([0, 100, 200, 100, 0], engage=None)
    bench.do("EGB=-1")
    assert bench.value("_EGB") == 1.0
    bench.do("EQB=99999")
    assert bench.value("_EGB") == 0.0


def test_segments_can_be_widened() -> None:
    bench = Bench()
    bench.do(QUICK, "EAA", "EMA=1500", "EP 500", "EW 0,1000", "ET[0]=,0;ET[1]=,100;ET[2]=,0", "EB 1", "EGB=0")
    assert bench.value("_EW") == 0.0
    bench.do("JGA=1000;BGA")
    assert bench.at(1.0).positions()[1] == pytest.approx(100, abs=1)
    assert bench.at(1.25).positions()[1] == pytest.approx(50, abs=1)


def test_entries_can_be_set_one_after_the_other() -> None:
    bench = Bench()
    bench.do("EC 0", "ET ,5,6", "ET ,7", "EC 1")
    assert bench.say("ET ,?,?") == " 7, 0\r\n:"
    assert bench.say("ET[0]=,?,?") == " 5, 6\r\n:"
    assert bench.value("_EC") == 1.0


def test_st_lets_a_slave_go() -> None:
    bench = cam([0, 1000, 2000, 1000, 0])
    bench.do("DCB=10240", "JGA=1000;BGA")
    before = bench.at(0.25).positions()[1]
    bench.do("STB")
    assert bench.at(3.0).value("_EGB") == 0.0
    assert bench.positions()[1] == pytest.approx(before + 2000 * 2000 / 2 / 10_240, abs=2)
    assert bench.value("_SCB") == 4.0


def test_eb_0_stops_all_slaves() -> None:
    bench = cam([0, 1000, 2000, 1000, 0])
    bench.do("JGA=1000;BGA")
    before = bench.at(0.25).positions()[1]
    bench.do("EB 0")
    assert bench.at(2.0).positions()[1] == before
    assert (bench.value("_SCB"), bench.value("_EB")) == (61.0, 0.0)


def test_the_usual_master_is_the_virtual_axis_n() -> None:
    bench = Bench()
    bench.do("EMN=1000", "EP 500", "ET[0]=,0;ET[1]=,80;ET[2]=,0", "EB 1", "EGB=0", "PRN=750;BGN")
    assert bench.at(3.0).positions() == [0, 40, 0]


@pytest.mark.parametrize(
    ("commands", "code"),
    [
        ("EGB=0", ErrorCode.CAM_NOT_ENABLED),
        ("EQB=0", ErrorCode.CAM_NOT_ENABLED),
        ("EB 1", ErrorCode.CAM_WITHOUT_MASTER),
        ("EMN=1025;EP 4;EB 1", ErrorCode.CAM_MODULUS),
        ("EMN=1024;EP 4;EB 1;EP 5", ErrorCode.CAM_RUNS),
        ("EMN=1024;EB 1;EAA", ErrorCode.CAM_RUNS),
        ("EMN=1024;EB 1;EGB=0;PRB=5;BGB", ErrorCode.NOT_IN_CAM),
        ("EAA;EMA=1024;EB 1;EGA=0", ErrorCode.GEAR_MASTER_IS_SLAVE),
        ("ET[257]=1", ErrorCode.CAM_INDEX),
        ("ET[-1]=1", ErrorCode.CAM_INDEX),
        ("EC 257", ErrorCode.OUT_OF_RANGE),
        ("EP 0", ErrorCode.OUT_OF_RANGE),
        ("EAS", ErrorCode.OPERAND_ERROR),
    ],
)
def test_misuse_has_its_code(commands: str, code: ErrorCode) -> None:
    bench = Bench()
    *before, last = commands.split(";")
    bench.do(*before)
    assert bench.code(last) == code
