"""Trippoints: every one goes on in the first sample at or after what it waits for, by the plan that is valid then."""

from __future__ import annotations

from math import ceil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.program_bench import SAMPLE, ProgramBench

SLOW = "SPA=10240;ACA=10240;DCA=10240"
"""One second and 5120 counts each to get up to speed and down again."""


def waited(statement: str, before: str = "", until: float = 30.0) -> float:
    """Return how many samples a program waits at a statement, executed in the sample that `before` has ended in."""
    bench = ProgramBench(f"{before}\nt=TIME\n{statement}\nt=TIME-t\nEN")
    bench.run(until)
    return bench.value("t") - 1


@pytest.mark.parametrize(
    ("statement", "samples"),
    [
        ("WT 1000", 1024),
        ("WT 1000,0", 1024),
        ("WT 1000,1", 1000),
        ("WT 2", 3),  # 2.048 samples
        ("WT 3", 3),  # the resolution is 2 ms
        ("WT 3,1", 2),
        ("WT 0", 1),
        ("WT 1", 1),
        ("n=500;WT n*2", 1025),  # the assignment takes a sample
        ("AT 0;AT 1000;AT 500", 1025),
        ("AT 0;WT 100,1;AT 500,1", 500),
        ("AT 0;AT -100,1;AT -100,1;WT 50,1;AT 100,1", 300),
        ("AM", 1),
        ("AMS", 1),
        ("MCA", 1),
        ("AS", 1),
        ("AD 1000", 1),
        ("AR 1000", 1),
        ("AV 1000", 1),
        ("AI 3", 1),
        ("AP 0", 1),
        ("MF -5", 1),
        ("MR 5", 1),
    ],
)
def test_times_and_conditions_that_hold_already(statement: str, samples: int) -> None:
    assert waited(statement) == samples


@pytest.mark.parametrize(
    ("statement", "seconds"),
    [
        ("PRA=20480;BGA;AMA", 3.0),
        ("PRA=20480;BGA;AM", 3.0),
        ("PRA=20480;BGA;MCA", 3.0),
        ("PRA=20480;BGA;ADA=5120", 1.0),
        ("PRA=20480;BGA;AD 10240", 1.5),
        ("PRA=-20480;BGA;ADA=10240", 1.5),
        ("PRA=20480;BGA;AD 5120;AR 5120", 1.5),
        ("PRA=20480;BGA;ARA=5120;ARA=5120;ARA=5120", 2.0),
        ("PRA=20480;BGA;ARA=99999", 3.0),
        ("PRA=20480;BGA;ASA", 1.0),
        ("PRA=20480;BGA;WT 500;ASA", 1.0),
        ("PRA=20480;BGA;APA=10240", 1.5),
        ("PRA=20480;BGA;MFA=15360", 2.0),
        ("PRA=-20480;BGA;MRA=-15360", 2.0),
        ("PRA=-20480;BGA;APA=-10240", 1.5),
        ("PRA=20480;BGA;MRA=-15360;MG 1", None),
        ("JGA=10240;BGA;ASA", 1.0),
        ("SPN=10240;ACN=10240;DCN=10240;PRN=20480;BGN;AMN", 3.0),
        ("SPN=10240;ACN=10240;DCN=10240;PRN=20480;BGN;AM", 3.0),
        ("SPM=10240;ACM=10240;DCM=10240;PRM=20480;BGM;ADM=10240", 1.5),
        ("SPM=10240;ACM=10240;DCM=10240;PRM=20480;BGM;ASM", 1.0),
        ("JGA=10240;BGA;ASA;JGA=5120;ASA", 1.5),
        ("JGA=10240;BGA;ADA=25600;STA;AMA", 4.0),
        ("PRA=20480;BGA;WT 1500;STA;AMA", 2.5),
        ("PRA=1024;BGA;ASA", 0.3162),  # a triangle never gets up to its speed: 2 * 0.316 s in all
        ("LMA;VS 10240;VA 10240;VD 10240;LI 20480;LE;BGS;AVS=10240", 1.5),
        ("LMA;VS 10240;VA 10240;VD 10240;LI 20480;LE;BGS;AV 15360", 2.0),
        ("LMA;VS 10240;VA 10240;VD 10240;LI 20480;LE;BGS;AMS", 3.0),
        ("LMA;VS 10240;VA 10240;VD 10240;LI 20480;LE;BGS;AMA", 3.0),
        ("LMA;VS 10240;VA 10240;VD 10240;LI 20480;LE;BGS;ASS", 1.0),
    ],
)
def test_motions_are_waited_for_by_their_plan(statement: str, seconds: float | None) -> None:
    bench = ProgramBench(f"{SLOW}\n{statement.replace(';BG', ';t=TIME;BG')}\nt=TIME-t;done=1\nEN")
    bench.do("done=0")
    bench.run(30.0)
    if seconds is None:
        assert bench.value("done") == 0.0
        assert bench.state() == 2
        return
    assert bench.value("done") == 1.0
    # The motion begins a sample behind t; each trippoint lasts a sample at least.
    assert seconds * 1024 <= bench.value("t") <= seconds * 1024 + 6


def test_a_plan_that_changes_is_looked_at_again() -> None:
    bench = ProgramBench(f"{SLOW};PRA=20480;BGA;ADA=10240;MG TIME{{Z6.0}};EN")
    bench.do("XQ")
    bench.at(0.5).do("SPA=2048")
    bench.at(20.0)
    # The motion begins in sample 5. At 0.5 s it brakes to 2048 counts/s, which it keeps.
    moved = 0.5 - 5 * SAMPLE
    speed = 10240 * moved
    braking = (speed - 2048) / 10240
    rest = 10240 - speed * moved / 2 - (speed + 2048) / 2 * braking
    (said,) = bench.said()
    assert int(said) == ceil((0.5 + braking + rest / 2048) * 1024)


def test_a_motion_that_is_stopped_is_over_when_it_rests() -> None:
    bench = ProgramBench(f"{SLOW};PRA=20480;BGA;AMA;MG TIME{{Z6.0}};EN")
    bench.do("XQ")
    bench.at(1.5).do("STA")
    bench.at(20.0)
    (said,) = bench.said()
    assert float(said) == pytest.approx(2.5 * 1024, abs=3)


def test_several_axes_are_waited_for_together() -> None:
    bench = ProgramBench("SP*=1024;AC*=10240;DC*=10240\nPR 1024,3072;BGAB;AMA;a=TIME;AM;b=TIME;EN")
    bench.run(10.0)
    assert bench.value("a") == pytest.approx(1.1 * 1024, abs=8)
    assert bench.value("b") == pytest.approx(3.1 * 1024, abs=10)


def test_an_input_is_waited_for_by_its_level() -> None:
    bench = ProgramBench("AI -3;MG 1;AI 3;MG 2;EN")
    bench.do("XQ")
    assert bench.at(1.0).said() == []
    assert bench.state() == 2
    bench.machine.unit.inputs[2] = False
    bench.machine.look()
    assert bench.at(2.0).said() == ["1.0000"]
    bench.machine.unit.inputs[2] = True
    bench.machine.look()
    assert bench.at(3.0).said() == ["2.0000"]


def test_mc_waits_for_the_encoder_and_gives_it_up() -> None:
    bench = ProgramBench("TWA=500;PRA=1000;BGA;MCA;MG _SCA;EN\n#MCTIME;MG 5;EN")
    bench.plant.hold(0)
    bench.do("ERA=99999", "XQ 0,1")
    bench.at(0.2)
    assert bench.state(1) == 2
    bench.at(5.0)
    assert sorted(bench.said()) == ["5.0000", "99.0000"]
    assert bench.value("_SCA") == 99.0


def test_mc_without_a_limit_waits_for_ever() -> None:
    bench = ProgramBench("TWA=-1;PRA=1000;BGA;MCA;MG 1;EN")
    bench.plant.hold(0)
    bench.do("ERA=99999", "XQ")
    assert bench.at(40.0).said() == []
    bench.plant.release(0)
    assert bench.at(40.1).said() == ["1.0000"]


def test_ap_waits_for_the_encoder_not_the_reference() -> None:
    bench = ProgramBench(f"{SLOW};PRA=10240;BGA;APA=5120;MG 1;EN")
    bench.plant.hold(0)
    bench.do("ERA=99999", "XQ")
    assert bench.at(3.0).said() == []
    bench.plant.release(0)
    assert bench.at(3.1).said() == ["1.0000"]


def test_a_place_is_in_the_counts_of_the_controller() -> None:
    bench = ProgramBench(f"{SLOW};DPA=1000;PRA=20480;BGA;APA=11240;MG TIME{{Z6.0}};EN")
    (said,) = bench.run(10.0)
    assert float(said) == pytest.approx(1.5 * 1024, abs=10)


def test_an_axis_may_be_named_by_a_variable() -> None:
    bench = ProgramBench(f"{SLOW};~a=0;PR~a=20480;BG~a;AM~a;MG _BGA,TIME{{Z6.0}};EN")
    (said,) = bench.run(10.0)
    assert said.startswith("0.0000")
    assert float(said.split()[1]) == pytest.approx(3.0 * 1024, abs=10)


@pytest.mark.parametrize("period", [500, 2000])
def test_times_hold_at_another_sample_period(period: int) -> None:
    bench = ProgramBench("t=TIME;WT 1000;t=TIME-t;EN")
    bench.at(1.0).do(f"TM {period}", "XQ")
    bench.at(1.97)
    assert bench.state() == 2
    assert bench.at(2.1).state() == 0
    assert bench.value("t") == ceil(1024 * 1000 / period) + 1


@given(st.integers(0, 5000).map(lambda n: 2 * n), st.floats(0.0, 2.0))
def test_a_wait_ends_in_its_sample_whenever_it_began(span: int, start: float) -> None:
    bench = ProgramBench("MG TIME{Z9.0};WT n,1;MG TIME{Z9.0};EN")
    bench.do(f"n={span}")
    bench.at(start).do("XQ")
    bench.at(start + (span + 10) * SAMPLE)
    before, after = (int(said) for said in bench.said())
    # On the edge of a sample, rounding decides the side.
    assert before in {int(start / SAMPLE + side) + 1 for side in (-1e-9, 1e-9)}
    assert after - before == max(2, span + 1)


@given(st.integers(-20000, 20000).filter(bool), st.integers(1, 20000), st.integers(100, 20000))
def test_distance_is_measured_on_the_reference(distance: int, mark: int, speed: int) -> None:
    bench = ProgramBench(f"SPA={speed};PRA={distance};BGA;ADA={mark};p=_RPA;w=_BGA;EN")
    bench.run(400.0)
    went = abs(bench.value("p"))
    if bench.value("w"):
        assert went >= mark
        assert went <= mark + 2 * speed * SAMPLE + 1
    else:
        assert went >= min(mark, abs(distance))


@pytest.mark.parametrize("statement", ["AD 1,2", "AV 1,2", "ADA=?", "AV -1", "AMQ", "MC S", "AS R", "APN=5"])
def test_misuse_ends_the_thread(statement: str) -> None:
    bench = ProgramBench()
    assert bench.run(0.1, f"{statement};MG 1;EN") == [f"?0 {statement}"]
    assert bench.value("_TC") in (
        ErrorCode.OPERAND_ERROR,
        ErrorCode.OUT_OF_RANGE,
        ErrorCode.INVALID_AXIS,
        ErrorCode.S_OPERAND_INVALID,
        ErrorCode.QUESTION_MARK_INVALID,
    )
