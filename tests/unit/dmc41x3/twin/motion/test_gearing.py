"""Gearing: the slave is where the ratio puts it, however the master moves and however it is looked at."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench

ROUND = "AC*=10240;DC*=10240;SD*=10240;SP*=10240"


def geared(ratio: float = 2.0, master: str = "A", *before: str) -> Bench:
    bench = Bench()
    bench.do(ROUND, *before, f"GAB={master}", f"GRB={ratio:.4f}")
    return bench


@pytest.mark.parametrize("master", ["A", "CA", "X"])
def test_a_slave_follows_a_move_to_its_end(master: str) -> None:
    bench = geared(-1.5, master)
    bench.do("PRA=20480;BGA")
    assert bench.at(1.0).positions()[:2] == [5_120, -7_680]
    assert bench.at(2.0).positions()[:2] == [15_360, -23_040]
    assert bench.at(9.0).positions()[:2] == [20_480, -30_720]
    assert bench.value("_TPB") == -30_720


@given(
    ratio=st.integers(-8 * 65536, 8 * 65536).map(lambda raw: raw / 65536),
    jogs=st.lists(st.integers(-7_000, 7_000).map(lambda speed: 2 * speed), min_size=1, max_size=5),
    pauses=st.lists(st.floats(0.001, 0.7), min_size=5, max_size=5),
)
def test_a_slave_is_its_ratio_times_its_master_at_all_times(ratio: float, jogs: list[int], pauses: list[float]) -> None:
    bench = geared(ratio)
    kept = bench.value("_GRB")
    bench.do("JGA=0;BGA")
    now = 0.0
    for speed, pause in zip(jogs, pauses, strict=False):
        bench.do(f"JGA={speed}")
        now += pause
        master, slave = bench.at(now).positions()[:2]
        assert abs(slave - kept * master) <= 0.5 * abs(kept) + 1.0
    bench.do("STA")
    master, slave = bench.at(now + 5.0).positions()[:2]
    assert abs(slave - kept * master) <= 0.5 * abs(kept) + 1.0


def test_slave_steps_with_its_master() -> None:
    bench = geared(2.0)
    bench.do("JGA=0;BGA", "IPA=300")
    assert bench.positions()[:2] == [300, 600]


def test_gearing_over_a_distance_lacks_half_of_it() -> None:
    bench = geared(0.0)
    bench.do("GDB=1000", "GRB=1", "JGA=10240;BGA")
    master, slave = bench.at(2.0).positions()[:2]
    assert master - slave == 500
    assert bench.value("_GPB") == 500.0
    assert bench.value("_TVB") == pytest.approx(10_240, abs=2)


def test_a_slave_moves_by_itself_on_top() -> None:
    bench = geared(1.0)
    bench.do("JGA=1024;BGA")
    bench.at(1.0).do("PRB=10240;BGB")
    assert bench.value("_BGB") == 1.0
    master, slave = bench.at(9.0).positions()[:2]
    assert slave - master == 10_240
    assert bench.value("_BGB") == 0.0


def test_a_slave_counts_as_at_rest() -> None:
    bench = geared()
    bench.do("JGA=1024;BGA")
    assert bench.at(1.0).value("_BGB") == 0.0


def test_st_takes_a_slave_out_of_gear_and_brakes_it() -> None:
    bench = geared(1.0)
    bench.do("JGA=10240;BGA")
    before = bench.at(2.0).positions()[1]
    bench.do("STB")
    assert (bench.value("_SCB"), bench.value("_BGB"), bench.value("_GRB")) == (4.0, 1.0, 0.0)
    assert bench.at(9.0).positions()[1] == pytest.approx(before + 5_120, abs=1)
    assert bench.value("_BGA") == 1.0


def test_a_gantry_stays_in_gear() -> None:
    bench = geared(1.0, "CA", "GMB=1")
    bench.do("JGA=10240;BGA")
    bench.at(2.0).do("STB")
    master, slave = bench.at(4.0).positions()[:2]
    assert master == slave > 20_000
    assert bench.value("_GRB") == 1.0


def test_a_limit_takes_a_slave_out_of_gear_at_sd() -> None:
    bench = geared(1.0)
    bench.do("SDB=20480", "JGA=10240;BGA")
    before = bench.at(2.0).positions()[1]
    bench.switch(1, forward=False)
    assert bench.value("_SCB") == 2.0
    assert bench.at(9.0).positions()[1] == pytest.approx(before + 2_560, abs=1)


def test_a_soft_limit_holds_for_a_slave() -> None:
    bench = geared(1.0, "A", "FLB=5000")
    bench.do("JGA=10240;BGA")
    assert bench.at(9.0).value("_SCB") == 2.0
    assert 5_000 < bench.positions()[1] < 5_000 + 5_120 + 30


def test_ratio_zero_stops_a_slave_at_once() -> None:
    bench = geared(1.0)
    bench.do("JGA=10240;BGA")
    before = bench.at(2.0).positions()[1]
    bench.do("GRB=0")
    assert bench.at(3.0).positions()[1] == pytest.approx(before, abs=1)
    assert bench.value("_TVB") == 0.0


def test_slave_whose_motor_goes_off_is_out_of_gear_and_a_gantry_is_not() -> None:
    for gantry in (0, 1):
        bench = geared(1.0, "A", f"GMB={gantry}")
        bench.do("JGA=10240;BGA")
        bench.at(1.0).do("MOB")
        before = bench.at(2.0).positions()[1]
        bench.do("SHB")
        moved = bench.at(3.0).positions()[1] - before
        assert moved == pytest.approx(10_240 if gantry else 0, abs=25)


def test_a_fault_of_a_gantry_s_slave_stops_its_master() -> None:
    bench = geared(1.0, "A", "GMB=1;OEB=1;ERB=100")
    bench.do("JGA=10240;BGA")
    bench.at(1.0)
    bench.plant.hold(1)
    bench.at(2.0)
    assert (bench.value("_MOB"), bench.value("_SCA")) == (1.0, 4.0)
    assert bench.at(4.0).value("_BGA") == 0.0


def test_the_way_along_a_path_can_be_a_master() -> None:
    bench = Bench()
    bench.do("VS 10240;VA 10240;VD 10240", "GAC=S", "GRC=0.5", "LM AB;LI 3000,4000;LE;BGS")
    assert bench.at(9.0).positions() == [3000, 4000, 2500]


def test_a_virtual_axis_can_be_a_master() -> None:
    bench = geared(3.0, "N")
    bench.do("SPN=1000;PRN=500;BGN")
    assert bench.value("_BGN") == 1.0
    assert bench.at(2.0).positions() == [0, 1500, 0]
    assert (bench.value("_BGN"), bench.value("_RPN")) == (0.0, 500.0)


@pytest.mark.parametrize(
    ("commands", "code"),
    [
        ("GAB=B", ErrorCode.GEAR_MASTER_IS_SLAVE),
        ("GAB=CB", ErrorCode.GEAR_MASTER_IS_SLAVE),
        ("GAB=A;GAA=B", ErrorCode.GEAR_MASTER_IS_SLAVE),
        ("GAB=D", ErrorCode.INVALID_AXIS),
        ("GAB=CS", ErrorCode.OPERAND_ERROR),
        ("GAB=5", ErrorCode.OPERAND_ERROR),
        ("GRB=128", ErrorCode.OUT_OF_RANGE),
        ("GMB=2", ErrorCode.OUT_OF_RANGE),
    ],
)
def test_misuse_has_its_code(commands: str, code: ErrorCode) -> None:
    bench = Bench()
    *before, last = commands.split(";")
    bench.do(*before)
    assert bench.code(last) == code


def test_masters_are_given_by_number() -> None:
    bench = Bench()
    bench.do("GA ,CA,N")
    assert bench.say("GA ?,?,?") == "-1, 0, 10\r\n:"


def test_an_abort_ends_gearing() -> None:
    bench = geared(1.0)
    bench.do("JGA=10240;BGA")
    bench.at(1.0).do("AB 1")
    bench.do("JGA=10240;BGA")
    before = bench.positions()[1]
    assert bench.at(3.0).positions()[1] == before
