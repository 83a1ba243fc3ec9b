"""Automatic subroutines: on thread 0 whether it runs or not, once for each event, and back to where it was."""

from __future__ import annotations

import pytest

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.memory import ChecksumError
from dmc41x3.twin.plant import BenchPlant
from tests.unit.dmc41x3.twin.program_bench import ProgramBench

LIMIT = '#LIMSWI;MG "limit",_SCA{Z3.0};RE'
ERROR = '#POSERR;MG "error";RE'


def hits_forward(bench: ProgramBench) -> None:
    """Run axis A into its forward limit switch and off it again."""
    bench.do("JGA=10000;BGA")
    bench.samples(100).switch(0, forward=False)
    bench.machine.look()
    bench.samples(1000)
    bench.switch(0)
    bench.machine.look()


def test_a_limit_calls_its_subroutine_with_no_thread_running() -> None:
    bench = ProgramBench(LIMIT)
    hits_forward(bench)
    assert bench.said() == ["limit 2"]
    assert bench.value("_NO") == 0.0
    assert bench.value("_BGA") == 0.0


def test_a_soft_limit_calls_it_too() -> None:
    bench = ProgramBench(LIMIT)
    bench.do("FLA=1000", "JGA=10000;BGA")
    assert bench.at(1.0).said() == ["limit 2"]


def test_each_limit_calls_it_once() -> None:
    bench = ProgramBench(LIMIT)
    hits_forward(bench)
    bench.at(10.0)
    assert bench.said() == ["limit 2"]
    bench.do("JGA=-10000;BGA")
    bench.samples(100).switch(0, reverse=False)
    bench.samples(1000)
    assert bench.said() == ["limit 3"]


def test_without_the_label_nothing_runs() -> None:
    bench = ProgramBench("#OTHER;MG 1;EN")
    hits_forward(bench)
    assert bench.said() == []


def test_it_interrupts_thread_0_and_no_other() -> None:
    program = "#A;n=n+1;JP #A\n#B;m=m+1;JP #B\n#LIMSWI;WT 512,1;RE"
    bench = ProgramBench(program)
    bench.do("n=0;m=0", "XQ #A,0", "XQ #B,1", "JGA=10000;BGA")
    bench.at(1.0).switch(0, forward=False)
    bench.machine.look()
    bench.at(3.0)
    assert bench.value("m") == 3 * 512.0
    assert bench.value("n") == pytest.approx(3 * 512 - 257, abs=2)
    assert bench.place() == 0


@pytest.mark.parametrize(("end", "seconds"), [("RE", 1.0), ("RE 0", 1.0), ("RE 1", 2.0)])
def test_a_wait_is_over_or_resumed(end: str, seconds: float) -> None:
    bench = ProgramBench(f"WT 2000;MG TIME{{Z6.0}};EN\n#LIMSWI;{end}")
    bench.do("XQ", "JGA=10000;BGA")
    bench.at(1.0).switch(0, forward=False)
    bench.machine.look()
    (said,) = bench.at(5.0).said()
    assert int(said) == pytest.approx(seconds * 1024, abs=3)


def test_a_motion_that_was_waited_for_is_waited_for_again() -> None:
    bench = ProgramBench("PRB=51200;SPB=10240;BGB;AMB;MG _BGB;EN\n#LIMSWI;WT 200;RE 1")
    bench.do("XQ", "JGA=10000;BGA")
    bench.at(1.0).switch(0, forward=False)
    bench.machine.look()
    assert bench.at(3.0).said() == []
    assert bench.at(9.0).said() == ["0.0000"]


def test_subroutines_return_to_their_program() -> None:
    bench = ProgramBench("#A;JS #S;JP #A\n#S;WT 20;EN\n#LIMSWI;JS #T;MG 1;RE\n#T;MG 2;EN")
    bench.do("XQ")
    hits_forward(bench)
    assert bench.said() == ["2.0000", "1.0000"]
    assert bench.state() != 0


@pytest.mark.parametrize("oe", [0, 1])
def test_following_error_calls_its_subroutine_even_without_oe(oe: int) -> None:
    bench = ProgramBench(ERROR)
    bench.do(f"OEA={oe}", "ERA=100", "JGA=10000;BGA")
    bench.samples(100)
    bench.plant.hold(0)
    bench.samples(500)
    assert bench.said() == ["error"]
    assert bench.value("_MOA") == oe
    bench.at(5.0)
    assert bench.said() == []


def test_repeated_following_error_calls_again() -> None:
    bench = ProgramBench(ERROR)
    bench.do("ERA=100", "JGA=10000;BGA")
    for _ in range(3):
        bench.plant.hold(0)
        bench.samples(500)
        assert bench.said() == ["error"]
        bench.plant.release(0)
        bench.samples(500)
        assert bench.said() == []


def test_an_amplifier_fault_calls_its_subroutine() -> None:
    bench = ProgramBench('#AMPERR;MG "amp",_TA0{Z3.0};RE')
    bench.machine.amplifier_fault(1 << 24)
    assert bench.at(0.1).said() == ["amp 1"]
    bench.machine.amplifier_fault(0)
    assert bench.at(0.2).said() == []


def test_a_lost_connection_calls_its_subroutine() -> None:
    bench = ProgramBench("#TCPERR;MG _IA4,_TC;RE")
    bench.machine.unit.tcp_error(3)
    bench.machine.look()
    assert bench.at(0.1).said() == ["3.0000 123.0000"]


def test_one_that_is_due_while_another_runs_waits_for_its_turn() -> None:
    bench = ProgramBench(f"#LIMSWI;MG 1;WT 500;MG 2;RE\n{ERROR}")
    bench.do("ERB=100", "JG 10000,10000;BGAB")
    bench.samples(100).switch(0, forward=False)
    bench.machine.look()
    bench.plant.hold(1)
    assert bench.samples(300).said() == ["1.0000"]
    assert bench.samples(600).said() == ["2.0000", "error"]


def test_an_error_calls_cmderr_and_the_thread_stops() -> None:
    bench = ProgramBench("#A;bad!;MG 1;EN\n#CMDERR;MG _ED0,_ED1,_TC;EN")
    assert bench.run(0.1, start="XQ #A,0") == ["0.0000 0.0000 1.0000"]
    assert bench.value("_NO") == 0.0
    assert bench.run(0.2, start="XQ #A,4") == ["0.0000 4.0000 1.0000"]
    assert bench.value("_NO") == 0.0


@pytest.mark.parametrize("thread", [0, 4])
def test_en_1_resumes_behind_the_error(thread: int) -> None:
    bench = ProgramBench("#A;bad!;MG 1;EN\n#CMDERR;EN 1")
    assert bench.run(0.1, start=f"XQ #A,{thread}") == ["1.0000"]


def test_error_in_another_thread_leaves_thread_0_running() -> None:
    bench = ProgramBench("XQ #B,1;WT 100;MG 1;EN\n#B;bad!\n#CMDERR;MG 2;EN")
    assert bench.run(1.0) == ["2.0000", "1.0000"]


def test_cmderr_may_clear_the_stack_and_restart() -> None:
    bench = ProgramBench("n=0\n#A;n=n+1;JS #S;MG n;EN\n#S;MG @SQR[nope]\nEN\n#CMDERR;nope=9;ZS;JP #A")
    assert bench.run(1.0) == ["3.0000", "2.0000"]


def test_an_error_within_cmderr_ends_it() -> None:
    bench = ProgramBench("bad!\n#CMDERR;worse!;EN")
    assert bench.run(1.0) == ["?1 worse!"]
    assert bench.value("_NO") == 0.0


def test_an_error_within_another_automatic_subroutine_is_dealt_with() -> None:
    bench = ProgramBench("#LIMSWI;bad!;MG 1;RE\n#CMDERR;MG 2;EN 1")
    hits_forward(bench)
    assert bench.said() == ["2.0000", "1.0000"]
    assert bench.value("_NO") == 0.0


def pressed(bench: ProgramBench, bit: int, level: bool) -> ProgramBench:
    bench.machine.unit.inputs[bit - 1] = level
    bench.machine.look()
    return bench.samples(20)


def test_an_input_interrupts_when_it_changes_to_its_level() -> None:
    bench = ProgramBench("#ININT;MG @IN[2];RI")
    bench.do("II 2")
    assert pressed(bench, 2, False).said() == ["0.0000"]
    assert pressed(bench, 1, False).said() == []
    assert pressed(bench, 2, True).said() == []
    assert pressed(bench, 2, False).said() == ["0.0000"]
    bench.do("II 0")
    pressed(bench, 2, True)
    assert pressed(bench, 2, False).said() == []


def test_inputs_may_be_a_range_or_a_mask_each_with_its_level() -> None:
    bench = ProgramBench('#ININT;MG "in";RI')
    bench.do("II 1,2,,2")
    assert pressed(bench, 1, False).said() == ["in"]
    assert pressed(bench, 2, False).said() == []
    assert pressed(bench, 2, True).said() == ["in"]
    bench.do("II ,,4")
    assert pressed(bench, 3, False).said() == ["in"]


def test_an_input_interrupt_gives_way_to_an_error() -> None:
    bench = ProgramBench(f'#ININT;MG "in";WT 500;MG "out";RI\n{LIMIT}')
    bench.do("II 1", "JGA=10000;BGA")
    assert pressed(bench, 1, False).said() == ["in"]
    assert int(bench.say("TB")[:-3]) & 0x1C == 0x0C
    bench.switch(0, forward=False)
    bench.machine.look()
    bench.samples(1)
    assert int(bench.say("TB")[:-3]) & 0x18 == 0x18
    assert bench.samples(100).said() == ["limit 2", "out"]  # RE without 1 ends the wait


def test_programs_that_are_ended_are_not_called_again() -> None:
    bench = ProgramBench("#LIMSWI;WT 1000;MG 1;RE")
    hits_forward(bench)
    bench.do("HX")
    assert bench.at(10.0).said() == []


def test_auto_runs_at_power_up_and_at_every_reset() -> None:
    plant = BenchPlant()
    machine = VirtualDmc(plant)
    machine.unit.memory.contents.program = "#AUTO\r\nn=TIME\r\n#L\r\nWT 10;JP #L\r\n"
    machine.power_on()
    machine.advance(1.0)
    assert machine.unit.threads.mask == 1
    assert machine.unit.variables["n"] == 65536
    machine.power_off()
    assert machine.unit.threads.mask == 0
    machine.advance(2.0)
    assert machine.unit.threads.mask == 0
    machine.power_on()
    machine.advance(3.0)
    assert machine.unit.threads.mask == 1


def test_autoerr_runs_if_burned_memory_is_damaged() -> None:
    machine = VirtualDmc(BenchPlant())
    machine.unit.memory.contents.program = "#AUTO;n=1;EN\r\n#AUTOERR;n=_TC;EN\r\n"
    machine.unit.memory.errors = ChecksumError.PARAMETERS
    machine.power_on()
    machine.advance(1.0)
    assert machine.unit.variables["n"] == 14 * 65536


def test_auto_of_a_program_that_was_burned_and_reset() -> None:
    bench = ProgramBench("#AUTO;SB 1;EN")
    bench.do("BP")
    bench.raw("RS\r")
    bench.at(1.0)
    assert bench.plant.outputs[1]
