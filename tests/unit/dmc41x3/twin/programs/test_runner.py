"""Threads in time: one statement a sample, eight at once, halted in every way, and a machine that stays responsive."""

from __future__ import annotations

from random import Random

import pytest

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.commands import FORMS
from dmc41x3.twin.runner import LEISURE
from tests.campaign import Campaign
from tests.unit.dmc41x3.twin.program_bench import SAMPLE, ProgramBench

RUNAWAY = "#A;n=n+1;JP #A"


def test_a_thread_executes_one_statement_in_a_sample() -> None:
    bench = ProgramBench("a=TIME;b=TIME\nc=TIME\nJS #S;d=TIME;EN\n#S;EN")
    bench.at(1.0).do("XQ")
    bench.at(2.0)
    assert [bench.value(name) for name in "abcd"] == [1025.0, 1026.0, 1027.0, 1030.0]


def test_it_executes_nothing_before_its_sample() -> None:
    bench = ProgramBench(RUNAWAY)
    bench.do("n=0", "XQ")
    assert bench.value("n") == 0.0
    assert bench.at(0.9 * SAMPLE).value("n") == 0.0
    assert bench.at(SAMPLE).value("n") == 1.0
    assert bench.at(2.9 * SAMPLE).value("n") == 1.0
    assert bench.at(3.0 * SAMPLE).value("n") == 2.0


@pytest.mark.parametrize("pieces", [1, 3, 64, 1000])
def test_how_time_is_cut_into_pieces_makes_no_difference(pieces: int) -> None:
    bench = ProgramBench("#A;n=n+1;m=m+TIME%7\nIF (m>20);m=m-20;SB 1;ELSE;CB 1;ENDIF;WT 6,1;JP #A")
    bench.do("n=0;m=0", "JGA=3000;BGA", "XQ", "XQ #A,3")
    for piece in range(1, pieces + 1):
        bench.at(3.0 * piece / pieces)
    whole = ProgramBench("#A;n=n+1;m=m+TIME%7\nIF (m>20);m=m-20;SB 1;ELSE;CB 1;ENDIF;WT 6,1;JP #A")
    whole.do("n=0;m=0", "JGA=3000;BGA", "XQ", "XQ #A,3")
    whole.at(3.0)
    for name in ("n", "m", "_OP0", "_XQ0", "_XQ3", "_TPA"):
        assert bench.value(name) == whole.value(name)


def test_eight_threads_run_at_once_each_at_its_own_pace() -> None:
    bench = ProgramBench("\n".join(f"#T{number};a[{number}]=a[{number}]+1;JP #T{number}" for number in range(8)))
    bench.do("DM a[8]", *(f"a[{number}]=0" for number in range(8)))
    bench.do(*(f"XQ #T{number},{number}" for number in range(8)))
    bench.at(1.0)
    assert [bench.value(f"a[{number}]") for number in range(8)] == [512.0] * 8
    assert bench.value("_NO") == 255.0
    assert bench.record().threads == 255
    assert int(bench.say("TB")[:-3]) & 128


def test_the_threads_of_a_sample_go_in_the_order_of_their_numbers() -> None:
    bench = ProgramBench("XQ #B,5;XQ #C,2;WT 9,1;MG 0;EN\n#B;WT 10,1;MG 5;EN\n#C;WT 9,1;MG 2;EN")
    assert bench.run(0.1) == ["0.0000", "2.0000", "5.0000"]


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("XQ #NOPE", ErrorCode.UNDEFINED_LABEL),
        ("XQ 9", ErrorCode.INVALID_LABEL),
        ("XQ -1", ErrorCode.INVALID_LABEL),
        ("XQ #A,8", ErrorCode.OUT_OF_RANGE),
        ("XQ #A,-1", ErrorCode.OUT_OF_RANGE),
        ("XQ #E", ErrorCode.UNDEFINED_LABEL),
        ("HX 8", ErrorCode.OUT_OF_RANGE),
        ("TR 2", ErrorCode.OUT_OF_RANGE),
        ("BK 9", ErrorCode.INVALID_LABEL),
        ("SL", ErrorCode.NOT_WHILE_NOT_RUNNING),
        ("II 99", ErrorCode.OUT_OF_RANGE),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    assert ProgramBench("#A;WT 2;JP #A\n#E").code(command) == code


def test_a_busy_thread_is_not_started_again() -> None:
    bench = ProgramBench(RUNAWAY)
    bench.do("n=0", "XQ #A,4")
    assert bench.code("XQ #A,4") == ErrorCode.THREAD_EXECUTING
    bench.do("XQ #A,5", "HX 4", "XQ #A,4")


def test_position_of_a_thread() -> None:
    bench = ProgramBench("'one\nMG 1\nWT 100,1\nEN")
    assert (bench.place(), bench.state()) == (-1, 0)
    bench.do("XQ 1,6")
    assert (bench.place(6), bench.state(6)) == (1, 1)
    bench.samples(10)
    assert (bench.place(6), bench.state(6), bench.place()) == (2, 2, -1)
    assert bench.value("_NO") == 64.0
    bench.samples(100)
    assert (bench.place(6), bench.state(6)) == (-1, 0)


@pytest.mark.parametrize(
    ("command", "left"),
    [
        ("HX", 0),
        ("HX 3", 0b0001),
        ("HX 0", 0b1000),
        ("ST", 0),
        ("STA", 0b1001),
        ("AB", 0),
        ("AB 0", 0),
        ("AB 1", 0b1001),
    ],
)
def test_threads_end(command: str, left: int) -> None:
    bench = ProgramBench("#A;WT 100;JP #A")
    bench.do("XQ", "XQ #A,3")
    bench.at(1.0).do(command)
    assert bench.value("_NO") == left
    assert bench.at(2.0).value("_NO") == left


def test_a_stop_within_a_program_stops_axes_only() -> None:
    bench = ProgramBench("JGA=10000;BGA;WT 500;ST;AMA;MG _BGA;EN")
    assert bench.run(2.0) == ["0.0000"]


def test_an_abort_within_a_program_ends_the_program() -> None:
    bench = ProgramBench("XQ #B,1;WT 20;AB;MG 1;EN\n#B;WT 2;JP #B")
    assert bench.run(1.0) == []
    assert bench.value("_NO") == 0.0


@pytest.mark.parametrize(("setting", "left"), [("CN ,,,,0", 0.0), ("CN ,,,,1", 1.0)])
def test_the_abort_input_ends_programs_unless_cn_says_otherwise(setting: str, left: float) -> None:
    bench = ProgramBench("#A;WT 100;JP #A")
    bench.do(setting, "XQ")
    bench.at(1.0).machine.abort_input(True)
    assert bench.value("_NO") == left
    bench.do("HX", "XQ")
    assert bench.at(2.0).value("_NO") == 1.0  # only the edge of the input ends programs


def test_a_reset_ends_programs() -> None:
    bench = ProgramBench("#A;WT 100;JP #A")
    bench.do("XQ")
    bench.raw("RS\r")
    assert bench.machine.unit.threads.mask == 0
    assert bench.machine.next_event(100.0) is None


def test_a_runaway_loop_costs_a_statement_a_sample_and_no_more() -> None:
    bench = ProgramBench(RUNAWAY)
    bench.do("n=0", "XQ")
    for second in range(1, 6):
        bench.at(float(second))
        assert bench.value("n") == 512.0 * second
        assert bench.say("WH") == "IHA\r\n:"
    bench.do("HX")
    assert bench.at(60.0).value("n") == 2560.0


@pytest.mark.parametrize("statement", ["JS #A", "XQ #A,1", "SB 1", "MG n", "JP #A,_BGA=0", "WT 0", "AMA", "AT -2,1"])
def test_no_loop_holds_up_the_machine(statement: str) -> None:
    bench = ProgramBench(f"#A;n=n+1;{statement};JP #A")
    bench.do("n=0", "DPA=0;PRA=5120;SPA=5120;ACA=51200;DCA=51200", "BGA", "XQ")
    bench.at(2.0)
    assert bench.value("_TPA") == 5120.0
    assert 1.0 <= bench.value("n") <= 1024.0 * 2 * 2


def test_messages_of_a_program_go_to_the_port_of_cf_marked_by_cw() -> None:
    bench = ProgramBench("MG 1;MG {EB}2;EN")
    other = bench.connect()
    bench.do("CW 1", "XQ")
    bench.at(0.1)
    marked = [bytes(byte | 0x80 for byte in text) for text in (b" 1.0000\r\n", b" 2.0000\r\n")]
    assert bench.machine.take_messages() == [(bench.handle, marked[0]), (other, marked[1])]


def test_a_trace_shows_every_line_of_the_threads_it_is_for() -> None:
    bench = ProgramBench("#A;n=1;n=2\n'silent\nJS #S;EN\n#S;EN")
    bench.do("TR 1,2", "XQ #A,1", "XQ #A,2")
    bench.at(0.1)
    assert bench.said() == ["0 #A;n=1;n=2", "2 JS #S;EN", "3 #S;EN"]
    bench.do("TR 0", "XQ #A,1")
    bench.at(0.2)
    assert bench.said() == []


def test_a_breakpoint_holds_a_thread_and_steps_let_it_go_line_by_line() -> None:
    bench = ProgramBench("n=1\nn=2;n=3\nn=4\nn=5\nEN")
    assert bench.value("_BK") == -2147483648.0
    bench.do("BK 1")
    assert bench.value("_BK") == -1.0
    bench.do("XQ")
    bench.at(0.1)
    assert (bench.value("n"), bench.place(), bench.state(), bench.value("_BK")) == (1.0, 1, 2, 1.0)
    bench.do("SL")
    assert bench.at(0.2).value("n") == 3.0
    bench.do("SL 2")
    assert bench.at(0.3).value("n") == 5.0
    assert bench.state() == 2
    bench.do("BK")
    assert bench.at(0.4).state() == 0
    assert bench.value("_BK") == -2147483648.0


def test_thread_runs_to_a_breakpoint_set_at_a_breakpoint() -> None:
    """`BK 5` after `BK 3` goes on to line 5 (Galil's command reference, BK)."""
    bench = ProgramBench("n=1\nn=2\nn=3\nn=4\nEN")
    bench.do("BK 1", "XQ")
    assert bench.at(0.1).value("n") == 1.0
    bench.do("BK 3")
    assert bench.at(0.2).value("n") == 3.0
    assert (bench.state(), bench.value("_BK")) == (2, 3.0)


def test_a_breakpoint_is_for_one_thread() -> None:
    bench = ProgramBench("#A;n=n+1\nn=n+1\nEN")
    bench.do("n=0", "BK 1,3", "XQ #A,2")
    assert bench.at(0.1).value("n") == 2.0
    bench.do("XQ #A,3")
    assert bench.at(0.2).value("n") == 3.0
    bench.do("HX 3")
    assert bench.state(3) == 0


def test_a_new_program_is_the_one_that_runs() -> None:
    bench = ProgramBench("MG 1;EN")
    assert bench.run(0.1) == ["1.0000"]
    assert bench.run(0.2, "MG 2;EN") == ["2.0000"]


def test_a_program_that_is_downloaded_while_nothing_runs_does_not_start() -> None:
    bench = ProgramBench("#AUTO;MG 1;EN")
    assert bench.at(1.0).said() == []


def test_runner_wakes_only_for_its_own_work() -> None:
    bench = ProgramBench("#A;WT 1000,1;SB 1;JP #A")
    assert bench.machine.wake() == float("inf")
    bench.do("XQ")
    bench.samples(1)
    assert bench.machine.wake() == pytest.approx(1001 * SAMPLE)
    bench.do("HX")
    assert bench.machine.wake() == float("inf")


def test_a_program_that_says_nothing_wakes_at_leisure() -> None:
    bench = ProgramBench("#A;n=n+1;JP #A,n<2000;MG n;EN")
    bench.do("n=0", "XQ")
    wakes = 0
    while not (said := bench.said()):
        bench.at(bench.machine.wake())
        wakes += 1
    assert said == ["2000.0000"]
    assert bench.now == pytest.approx(4002 * SAMPLE, abs=1.1 * LEISURE)
    assert wakes <= 4002 * SAMPLE / LEISURE + 2


def test_a_program_waiting_for_a_motion_wakes_at_its_end() -> None:
    bench = ProgramBench("SPA=1024;ACA=1024;DCA=1024;PRA=2048;BGA;AMA;MG 1;EN")
    bench.do("XQ")
    bench.samples(10)
    wakes = 0
    while not (said := bench.said()):
        bench.at(bench.machine.wake())
        wakes += 1
    assert said == ["1.0000"]
    assert bench.now == pytest.approx(3.0 + 6 * SAMPLE, abs=2 * SAMPLE)
    assert wakes < 6


def test_a_program_that_sleeps_and_looks_costs_next_to_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = ProgramBench("#G;left=beat-TIME+2000;JP #OUT,(left<2)|(left>2000)\nWT 480,1;JP #G\n#OUT;out=1", axes=8)
    bench.do("beat=0;out=0", "JG*=2000;BG", "XQ #G,7")
    steps = 0
    plant = bench.machine.unit.core.plant
    advance = plant.advance

    def counted(t: float) -> None:
        nonlocal steps
        steps += 1
        advance(t)

    monkeypatch.setattr(plant, "advance", counted)
    for second in range(1, 101):
        bench.do("beat=TIME")
        bench.at(float(second))
    assert bench.value("out") == 0.0
    assert bench.state(7) == 2
    assert steps < 400


STATEMENTS = (
    "n=n+1",
    "m=n*3%17",
    "t=TIME",
    "p=_TPA+_RPB",
    "b=_BGA+@OUT[1]",
    "a[n%4]=m",
    "IF (n%3=0);m=m+a[0];ELSE;m=m-1;ENDIF",
    "IF (_BGA=1);k=k+1;ENDIF",
    "JS #S(n,&m)",
    "WT 4,1",
    "WT 30",
    "AT -20,1",
    "SB 1",
    "CB 1",
    "PRA=n;BGA",
    "JGB=500-n;BGB",
    "STB",
    "AMA",
    "ADA=5",
    "MG n,m",
    "nope!",
)
VARIABLES = ("n", "m", "t", "p", "b", "k", "a[0]", "a[1]", "a[2]", "a[3]")


def random_program(rng: Random) -> str:
    """Return loops for three threads, each of a few statements, with a subroutine they share."""
    loops = [f"#T{thread}\n" + "\n".join(rng.choices(STATEMENTS, k=rng.randint(1, 6))) for thread in range(3)]
    body = "\n".join(f"{loop}\nJP #T{thread},n<200\nEN" for thread, loop in enumerate(loops))
    return f"{body}\n#S;^b=^b+^a%5;EN ,,^a\n#CMDERR;k=k+_ED1;EN 1"


def test_statements_do_the_same_whether_they_are_hurried_through_or_looked_at_one_by_one(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=25, long=500)):
        rng = campaign.rng(case)
        program = random_program(rng)
        results: list[list[float]] = []
        for trace in (0, 1):
            bench = ProgramBench(program)
            bench.do("DM a[4]", "n=0;m=0;t=0;p=0;b=0;k=0;a[0]=0;a[1]=0;a[2]=0;a[3]=0", f"TR {trace}")
            bench.do("XQ #T0,0", "XQ #T1,1", "XQ #T2,5")
            results.append([])
            for moment in (0.1, 0.35, 1.0):
                bench.at(moment)
                operands = (*VARIABLES, "_TPA", "_TPB", "_OP0", "_NO", "_XQ0", "_XQ1", "_XQ5", "TIME", "_TC")
                results[-1] += [bench.value(operand) for operand in operands]
        assert results[0] == results[1], program


WORDS = tuple(sorted(FORMS))
TAILS = (
    "",
    "A",
    "S",
    "1",
    "1,2",
    "A=1",
    "?",
    "=",
    "-1",
    "#A,1",
    "a[]",
    "~a",
    "^a=1",
    '"x"',
    ",,1",
    "T=>-3",
    "n,1",
    "[",
)


def test_no_program_makes_it_raise(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=60, long=3000)):
        rng = campaign.rng(case)
        lines = ["#A"]
        for _ in range(rng.randint(1, 12)):
            parts = [f"{rng.choice(WORDS)} {rng.choice(TAILS)}" for _ in range(rng.randint(1, 3))]
            lines.append(";".join(parts)[:80])
        for label in rng.sample(["#LIMSWI", "#CMDERR", "#POSERR", "#ININT", "#MCTIME"], 2):
            lines.insert(rng.randrange(len(lines) + 1), label)
        bench = ProgramBench()
        bench.raw("DL\r" + "".join(f"{line}\r" for line in lines) + "\\DM a[9];n=1;~a=1\r")
        assert bench.program() == lines
        for thread in range(8):
            bench.raw(f"XQ {rng.randrange(len(lines))},{thread}\r")
        bench.at(0.2)
        bench.switch(0, forward=False)
        bench.machine.look()
        bench.at(0.4)
        assert bench.machine.now == 0.4
