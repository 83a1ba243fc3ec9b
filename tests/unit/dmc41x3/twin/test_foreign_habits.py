"""Input of public programs and clients, each with its source.

G is Galil's command reference for the DMC-4103, U its user manuals, others are programs and clients in use.
"""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench
from tests.unit.dmc41x3.twin.program_bench import ProgramBench


@pytest.mark.parametrize(
    "name", ["READY", "RESULT", "ENABLE", "ATIME", "END", "JSPEED", "RATE", "DLY", "ELSEWHR", "WTA", "REDO_1", "IN_POS"]
)
def test_program_assigns_a_variable_that_begins_like_a_command(name: str) -> None:
    """U: RESULT, SPEED, COUNT and the like are the manuals' own examples; the terminal took them, programs did not."""
    bench = ProgramBench(f"{name}=3\nout={name}+1\nEN")
    bench.do("XQ")
    assert bench.at(0.1).value("out") == 4.0
    assert bench.said() == []


@pytest.mark.parametrize("statement", ["SPA=4000", "SPX=4000", "SP 4000", "SP=4000"])
def test_program_still_takes_commands_of_axes(statement: str) -> None:
    """G: `SPA=n` and `SP n,n`; a name that begins like a command has no equals sign behind its axis."""
    bench = ProgramBench(f"{statement}\nEN")
    bench.do("XQ")
    bench.at(0.1)
    assert bench.value("_SPA") == (25000.0 if statement == "SP=4000" else 4000.0)


@pytest.mark.parametrize("statement", ["IFx=1;y=2;ENDIF", "IF x=1;y=2;ENDIF", "NOx=1;y=2", "NO y=1;y=2"])
def test_program_reads_conditions_and_remarks_as_before(statement: str) -> None:
    """G: IF and NO come first, whatever equals sign follows."""
    bench = ProgramBench(f"x=1;y=0;{statement};EN")
    bench.do("XQ")
    assert bench.at(0.1).value("y") == 2.0


def test_names_with_underscores_are_separate_variables_arrays_and_operands() -> None:
    """ISIS programs have curr_pos and g_hmstA; an operand still begins with its underscore."""
    bench = Bench()
    bench.do("a_b=1;PA_SPA;DM q_r[3];q_r[1]=a_b+1")
    assert bench.say("MG a_b,q_r[1],_SPA") == " 1.0000 2.0000 25000.0000\r\n:"
    assert bench.say("LV") == "a_b= 1.0000\r\n:"
    assert bench.say("LA") == "q_r[3]\r\n:"
    assert bench.code("_a=1") == ErrorCode.UNRECOGNIZED_COMMAND


def test_program_deallocates_arrays_before_it_first_dimensions_them() -> None:
    """The program of M2FS, a spectrograph, and its tests of noise begin so, at power-up too."""
    bench = ProgramBench("DA first[0],other[0]\nDM first[4],other[2]\nDA first[0]\nDM first[5]\nEN")
    bench.do("XQ")
    bench.at(0.1)
    assert bench.said() == []
    assert bench.say("LA") == "first[5]\r\nother[2]\r\n:"


@pytest.mark.parametrize("every", ["DA *[0]", "DA *[]"])
def test_da_takes_both_forms_of_every_array(every: str) -> None:
    """G, DA: `*[0]`; public programs write `*[]` as well."""
    bench = Bench()
    bench.do("DM first[3],other[2];v=1")
    bench.do(every)
    assert bench.say("LA") == ":"
    assert bench.say("MG v") == " 1.0000\r\n:"


@pytest.mark.parametrize("command", ["SP 1,2,3,4", "PR 1,2,3,4", "KP 1,2,3,4"])
def test_fields_of_axes_that_are_not_there_are_refused(command: str) -> None:
    """G, TC: 4, operand error; a machine of three axes has three fields."""
    assert Bench(axes=3).code(command) == ErrorCode.OPERAND_ERROR


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ("MG {$8.0} @COM[0]", "$FFFFFFFF"),  # G, @COM
        ("MG {$8.0} @COM[$FFFFFFFF]", "$00000000"),  # G, @COM
        ("MG{Z10.0}_RS", " 0"),  # G, #AUTOERR
        ('MG{Z5.0} "B axis finished in",7," samples"', "B axis finished in 7 samples"),  # G, AC
        ("MG 1{F2.0},{F3.1}2,3", " 01 002.0 3.0000"),
        ('MG "x",1,{F2.0}', "x 01"),
        ("MG {F2.0}1{F3.0}", " 001"),
        ("MG {^200}", "\xc8"),  # G, MG: 0 to 255
    ],
)
def test_message_takes_formats_before_and_behind_their_values(command: str, text: str) -> None:
    """G: its examples write both, one of them with a text between the format and its value."""
    assert Bench().raw(f"{command}\r") == f"{text}\r\n:".encode("latin-1")


@pytest.mark.parametrize("text", ["{F4.2}", '{F4.2}"x"', '"x"{F4.2}', "{Q}1", "{F11.0}1"])
def test_message_refuses_formats_without_a_value_and_bad_ones(text: str) -> None:
    assert Bench().code(f"MG {text}") == ErrorCode.BAD_BRACES


def test_empty_program_uploads_as_a_line_end() -> None:
    """EPICS cuts three bytes off what UL printed before Ctrl-Z, and ends with an exception where there are fewer."""
    bench = Bench()
    assert bench.raw("UL\r") == b"\r\n\x1a:"


def test_list_reaches_the_last_line_of_a_long_program() -> None:
    """G: LS begins at line 3998 at most, so that its end is no longer line 1999 (firmware 1.2a)."""
    bench = ProgramBench("\n".join(f"n={number}" for number in range(2500)))
    assert bench.say("LS 2498") == "2498 n=2498\r\n2499 n=2499\r\n:"
    assert bench.say("LS").endswith("2499 n=2499\r\n:")


@pytest.mark.parametrize(("command", "operand"), [("SH*", "_MOC"), ("SH *", "_MOC")])
def test_star_names_all_axes_of_a_mask(command: str, operand: str) -> None:
    """M2FS sends `ST*`; G has the star in `KP*=0` only, so that this is inferred."""
    bench = Bench()
    bench.do(command)
    assert bench.value(operand) == 0.0
    bench.do("JG*=1000;BG*")
    assert bench.at(0.5).value("_BGA+_BGB+_BGC") == 3.0
    bench.do("ST*")
    assert bench.at(2.0).value("_BGA+_BGB+_BGC") == 0.0
    bench.do("MO*")
    assert bench.value("_MOA+_MOB+_MOC") == 3.0


def test_star_behind_st_stops_axes_and_no_program() -> None:
    """G: only an ST that names nothing ends the program as well."""
    bench = ProgramBench("#A\nWT 100\nJP #A")
    bench.do("XQ", "ST*")
    assert bench.at(0.5).value("_NO") == 1.0


@pytest.mark.parametrize(("bare", "full"), [("_TP", "_TPA"), ("_SP", "_SPA"), ("_LF", "_LFA"), ("_TA", "_TA0")])
def test_bare_operand_is_that_of_the_first_axis(bare: str, full: str) -> None:
    """The Thirty Meter Telescope's programs print `_TA` in #CMDERR; that others are axis A is inferred."""
    bench = Bench()
    bench.do("DP 7;SP 4000")
    assert bench.value(bare) == bench.value(full)


@pytest.mark.parametrize("command", ["ACA=1023", "DCA=0", "SDB=1", "VAS=1000"])
def test_rates_below_their_least_are_refused(command: str) -> None:
    """G: 1024 is the least and TC 6 is a number out of range; the EPICS driver never sends less."""
    assert Bench().code(command) == ErrorCode.OUT_OF_RANGE


@pytest.mark.parametrize("value", [-1, 0, 1])
def test_br_takes_its_three_kinds_of_motor(value: int) -> None:
    """G: external drive, brushless, brush."""
    bench = Bench()
    bench.do(f"BR {value},{value}")
    assert bench.value("_BRB") == value
    assert bench.code("BR 2") == ErrorCode.OUT_OF_RANGE


def test_rates_of_a_plane_take_a_field_for_s_and_one_for_t() -> None:
    """G: `VA n,n` is S and T; a third plane there is not."""
    bench = Bench()
    bench.do("VA 20480,40960")
    assert bench.say("VA ?,?") == " 20480, 40960\r\n:"
    assert bench.value("_VAT") == 40960.0
    assert bench.code("VA 1024,1024,1024") == ErrorCode.OPERAND_ERROR


@pytest.mark.parametrize("text", ["MG (1==1)", "x==1", "MG 1==1"])
def test_two_equals_signs_are_no_comparison(text: str) -> None:
    """G lists six comparators, and `=` is the one for equal ones."""
    assert Bench().code(text) in (ErrorCode.OPERAND_ERROR, ErrorCode.UNRECOGNIZED_COMMAND)


@pytest.mark.parametrize(
    ("condition", "met"),
    [("(x=1)&(y=2)", True), ("((x=1)&(y=2))", True), ("((x=1) & (y=3))", False), ("(((x)=1))", True)],
)
def test_conditions_in_parentheses_are_met(condition: str, met: bool) -> None:
    """G, JP, JS and &: each condition stands in parentheses of its own."""
    bench = ProgramBench(f"x=1;y=2;n=0\nIF {condition}\nn=1\nENDIF\nJP #E,{condition}\nEN\n#E;n=n+1;EN")
    bench.do("XQ")
    assert bench.at(0.1).value("n") == 2.0 * met


def test_jump_to_its_own_line_waits_in_it() -> None:
    """G, JP: in `JP _XQ0-1,(TIME < (t+1000))` the operand is the line behind, and nothing before it is done again."""
    bench = ProgramBench("t=TIME\nn=0\nm=0;JP _XQ0-1,(TIME < (t+100))\nd=TIME-t\nMG n\nEN")
    bench.do("XQ")
    assert 100.0 <= bench.at(0.5).value("d") <= 103.0
    assert bench.said() == ["0.0000"]


@pytest.mark.parametrize(("target", "found"), [(2000, 500), (500, 2000)])
def test_forward_motion_of_several_axes_waits_for_the_first(target: int, found: int) -> None:
    """G, MF: several positions may be given, and one of them is enough."""
    bench = ProgramBench(f"SH AB;JG 1000,1000;BG AB;MF {target},{found};a=_RPA;ST;EN")
    bench.do("XQ")
    assert bench.at(3.0).value("a") == pytest.approx(500.0, abs=10.0)


def test_jog_without_speeds_is_the_mode() -> None:
    """Harvard's laser stage sends `JG` in each round of its loop."""
    bench = Bench()
    bench.do("JG 1000,2000;PR 5,5;JG;SHB;BGB")
    assert bench.at(1.0).value("_RPB") > 100.0


@pytest.mark.parametrize("value", [-1, 32766, 32767])
def test_tw_takes_its_whole_range(value: int) -> None:
    """G: -1 to 32767."""
    bench = Bench()
    bench.do(f"TWA={value}")
    assert bench.value("_TWA") == value
    assert bench.code("TWA=32768") == ErrorCode.OUT_OF_RANGE
    assert bench.code("TWA=-2") == ErrorCode.OUT_OF_RANGE


def test_trace_without_a_number_is_off() -> None:
    """G, TR: 0 or nothing ends the trace."""
    bench = ProgramBench("WT 4\nEN")
    bench.do("TR 1", "TR", "XQ")
    bench.at(0.1)
    assert bench.said() == []


def test_burn_by_a_host_waits_for_the_end_of_the_program() -> None:
    """G, TC 17: ED, BN and DL are not valid while a program runs."""
    bench = ProgramBench("#A\nWT 1000\nJP #A")
    bench.do("XQ")
    for command in ("BN", "DL", "ED"):
        assert bench.code(command) == ErrorCode.NOT_WHILE_PROGRAM_RUNS


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("GF32", "1 Unrecognized command"),
        ("RA a[]", "82 Undefined Array"),
        ("BGA", "20 Begin not valid with motor off"),
    ],
)
def test_tc1_prints_the_manufacturers_words(command: str, words: str) -> None:
    """G, TC and RA; the ESRF's tables hold the same words."""
    bench = Bench(servo=False)
    assert bench.say(command) == "?"
    assert bench.say("TC1") == f"{words}\r\n:"


@pytest.mark.parametrize(("source", "operand"), [("_DEA", "_DEA"), ("_SHA", "_RPA"), ("_TP", "_TPA")])
def test_recording_takes_the_second_encoder_and_both_names_of_the_reference(source: str, operand: str) -> None:
    """G, RD; the commissioning tool of ISIS records `_TPA` and `_DEA`."""
    bench = Bench()
    bench.do("DM a[2];RA a[];DP 7;DE 9", f"RD {source}", "RC 1")
    assert bench.at(0.1).value("a[1]") == bench.value(operand) != 0.0


def test_error_without_a_subroutine_for_it_ends_every_thread() -> None:
    """G, #CMDERR: without it the program and all threads stop, a guard on another thread too."""
    bench = ProgramBench("WT 100\nMG nothing\nEN\n#B\nWT 20\nJP #B\n")
    bench.do("XQ", "XQ #B,7")
    assert bench.at(0.05).value("_NO") == 129.0
    assert bench.at(0.5).value("_NO") == 0.0
    assert bench.said() == ["?1 MG nothing"]


def test_error_with_a_subroutine_for_it_ends_its_thread_only() -> None:
    """G, #CMDERR: the thread that erred is halted, others go on."""
    bench = ProgramBench("WT 100\nMG nothing\nEN\n#B\nWT 20\nJP #B\n#CMDERR\nEN\n")
    bench.do("XQ #B,7", "XQ 0,1")
    assert bench.at(0.5).value("_NO") == 128.0
