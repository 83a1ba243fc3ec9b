"""DM, DA, LA, LV, QU, QD and the recording of RA, RD, RC, as they are on the wire."""

from __future__ import annotations

from itertools import pairwise

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.fixture
def bench() -> Bench:
    """Axes with a filled array and an empty one."""
    bench = Bench()
    bench.do("DM a[3],b[5]", "a[0]=9;a[1]=-1.5;a[2]=$7FFFFFFF.FFFF")
    return bench


def test_the_corpus_line() -> None:
    bench = Bench()
    reply = bench.say("DM a[3];a[0]=9;MG a[-1];QU a[],0,2,1")
    assert reply == ":: 3.0000\r\n: 9.0000, 0.0000, 0.0000\r\n\x1a:"


def test_arrays_and_variables_are_listed_by_the_alphabet(bench: Bench) -> None:
    bench.do("DM Z9[1]", "y=2;x=-1")
    assert bench.say("LA") == "Z9[1]\r\na[3]\r\nb[5]\r\n:"
    assert bench.say("LV") == "x=-1.0000\r\ny= 2.0000\r\n:"


def test_empty_lists_are_just_a_prompt() -> None:
    assert Bench().say("LA;LV") == "::"


def test_free_elements_and_arrays(bench: Bench) -> None:
    assert bench.say("DM ?;DA ?") == " 23992\r\n: 28\r\n:"
    assert (bench.value("_DM"), bench.value("_DA")) == (23992, 28)


def test_sizes_and_indices_are_expressions(bench: Bench) -> None:
    bench.do("DM c[a[-1]+2*2]", "i=1", "c[a[i]+(2*i)+0.6]=7", "c[c[-1]-1]=c[1]+1")
    assert bench.say("QU c[],0,9,1").startswith(" 0.0000, 7.0000, 0.0000")
    assert bench.value("c[9]") == 8


def test_element_is_read_like_a_variable(bench: Bench) -> None:
    assert bench.say("a[1]=") == bench.say("a[1]=?") == "-1.5000\r\n:"
    assert bench.say("a[-1]=?") == " 3.0000\r\n:"


def test_an_element_may_be_compared_in_an_index(bench: Bench) -> None:
    bench.do("b[a[0]=9]=4")
    assert bench.value("b[1]") == 4


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        ("QU a[]", " 9.0000\r-1.5000\r 2147483647.9999\r\n\x1a:"),
        ("QU a[],1,1", "-1.5000\r\n\x1a:"),
        ("QU a[],1", "-1.5000\r 2147483647.9999\r\n\x1a:"),
        ("QU a[],,1,1", " 9.0000, -1.5000\r\n\x1a:"),
    ],
)
def test_an_array_is_sent(bench: Bench, command: str, reply: str) -> None:
    assert bench.say(command) == reply


@pytest.mark.parametrize("data", ["1,2,3", "1\r2\r3", "1\r\n2\r\n3\r\n", "1,2\r3\r", "1,\r2,\r3,"])
def test_an_array_is_taken(bench: Bench, data: str) -> None:
    assert bench.raw(f"QD b[],1,3\r{data}\\") == b"::"
    assert bench.say("QU b[],0,4,1") == " 0.0000, 1.0000, 2.0000, 3.0000, 0.0000\r\n\x1a:"
    assert bench.say("MG 1") == " 1.0000\r\n:"


def test_array_download_answers_nothing(bench: Bench) -> None:
    assert bench.raw("QD a[]\r") == b""
    assert bench.raw("1,2") == b""
    assert bench.raw(",3\r") == b""
    assert bench.raw("\\") == b"::"


def test_a_whole_memory_in_one_line(bench: Bench) -> None:
    bench.do("DM c[20000]")
    values = ",".join(str(value) for value in range(20000))
    assert bench.raw(f"QD c[]\r{values}\\") == b"::"
    assert bench.value("c[19999]") == 19999
    assert bench.code("x=" + "1" * 90) == ErrorCode.INPUT_BUFFER_FULL


@pytest.mark.parametrize(
    ("data", "code"),
    [
        ("1,x,3", ErrorCode.NOT_A_NUMBER),
        ("1,,3", ErrorCode.NOT_A_NUMBER),
        ("1+1", ErrorCode.NOT_A_NUMBER),
        ("3000000000", ErrorCode.NOT_A_NUMBER),
        ("1,2,3,4", ErrorCode.TOO_MANY_ELEMENTS),
    ],
)
def test_data_that_are_wrong_are_refused_and_the_rest_is_taken(bench: Bench, data: str, code: ErrorCode) -> None:
    assert bench.raw(f"QD a[]\r{data}\r\\") == b"?::"
    assert bench.machine.unit.error_code == code
    assert bench.value("a[0]") == (9 if data in ("1+1", "3000000000") else 1)


def test_variables_and_arrays_are_deallocated_separately(bench: Bench) -> None:
    bench.do("x=1;y=2", "DA x,a[0]")
    assert bench.say("LV;LA") == "y= 2.0000\r\n:b[5]\r\n:"
    bench.do("DA *")
    assert bench.say("LV;LA") == ":b[5]\r\n:"
    bench.do("DA *[0]")
    assert bench.say("LV;LA") == "::"


def test_missing_variable_deallocates_nothing(bench: Bench) -> None:
    bench.do("x=1")
    assert bench.code("DA x,nope") == ErrorCode.VARIABLE_ERROR
    assert bench.value("x") == 1


def test_an_array_that_is_not_there_keeps_nothing_else(bench: Bench) -> None:
    bench.do("x=1;DA x,nope[0]")
    assert bench.say("LV") == ":"


def test_a_reset_forgets_arrays_but_not_burned_ones(bench: Bench) -> None:
    bench.do("BV", "a[0]=1", "DM c[1]")
    bench.raw("RS\r")
    bench.handle = bench.connect()
    assert bench.say("LA") == "a[3]\r\nb[5]\r\n:"
    assert bench.value("a[0]") == 9


def test_recording_a_move() -> None:
    """A jog of 1024 counts/s at once; a record every 4 samples shows 4 counts more each time."""
    bench = Bench()
    bench.do("AC 1073740800", "JG 1024", "DM p[5],t[5]", "RA p[],t[]", "RD _RPA,TIME", "BGA")
    bench.at(1.0).do("RC 2")
    bench.at(1.5 / 1024 + 1.0)
    assert (bench.value("_RC"), bench.value("_RD")) == (1, 1)
    bench.at(1.1)
    assert (bench.value("_RC"), bench.value("_RD")) == (0, 5)
    times = [bench.value(f"t[{index}]") for index in range(5)]
    places = [bench.value(f"p[{index}]") for index in range(5)]
    assert times == [1025, 1029, 1033, 1037, 1041]
    assert [later - earlier for earlier, later in pairwise(places)] == [4, 4, 4, 4]


def test_recorded_values_are_of_the_same_sample() -> None:
    """Nobody looks in between. Under 1024000 counts/s², k samples after BG the axis is at k² 0.48828125 counts."""
    bench = Bench()
    bench.do("DM p[8]", "RA p[]", "RD _RPA", "AC 1024000", "JG 1000000", "BGA;RC 1")
    bench.at(0.5)
    assert [bench.value(f"p[{n}]") for n in range(8)] == [round((2 * n + 1) ** 2 * 0.48828125) for n in range(8)]


def test_samples_are_as_long_as_tm_says() -> None:
    """At TM 2000 a sample takes 2/1024 s; 1 s after power-up, with TM set at once, 512 have passed."""
    bench = Bench()
    bench.do("TM 2000", "DM t[4],p[4]", "RA t[],p[]", "RD TIME,_RPA", "AC 1073740800;JG 1024;BGA")
    bench.at(1.0).do("RC 1")
    bench.at(1.1)
    assert [bench.value(f"t[{n}]") for n in range(4)] == [513, 515, 517, 519]
    assert [bench.value(f"p[{n + 1}]-p[{n}]") for n in range(3)] == [4, 4, 4]


def test_circular_recording_continues_until_it_is_stopped() -> None:
    bench = Bench()
    bench.do("DM t[8]", "RA t[]", "RD TIME", "RC 1,-8")
    bench.at(100.5 / 1024)
    assert (bench.value("_RC"), bench.value("_RD")) == (1, 2)
    assert [bench.value(f"t[{n}]") for n in range(8)] == [97, 99, 85, 87, 89, 91, 93, 95]
    bench.do("RC 0")
    assert bench.say("RC ?") == " 0\r\n:"


def test_velocity_and_torque_are_recorded_as_the_data_record_has_them() -> None:
    bench = Bench()
    bench.do("AC 1073740800", "JG 1024", "DM v[1],t[1]", "RA v[],t[]", "RD _TVA,_TTB", "BGA")
    bench.plant.hold(1)
    bench.at(0.01).do("PRB=10;BGB")
    bench.at(0.5).do("RC 1")
    bench.at(0.6)
    assert bench.value("v[0]") == 64 * 1024
    assert bench.value("t[0]") == round(9.9982 * 3276.7)


def test_sources_may_be_named_by_an_axis_variable() -> None:
    bench = Bench()
    bench.do("DM p[1]", "DPC=77", "~a=2", "RA p[]", "RD _TP~a", "~a=0", "RC 1")
    bench.at(1.0)
    assert bench.value("p[0]") == 77


def test_a_reset_ends_recording() -> None:
    bench = Bench()
    bench.do("DM p[1]", "RA p[]", "RD TIME", "RC 8,-1")
    bench.raw("RS\r")
    bench.at(2.0)
    bench.handle = bench.connect()
    assert bench.value("_RC") == 0
    bench.do("DM p[1]", "RA p[]")
    assert bench.code("RC 1") == ErrorCode.NO_RECORDING_SOURCE


def test_at_most_eight_arrays_are_recorded() -> None:
    bench = Bench()
    bench.do(f"DM {','.join(f'a{n}[2]' for n in range(9))}")
    assert bench.code(f"RA {','.join(f'a{n}[]' for n in range(9))}") == ErrorCode.OPERAND_ERROR
    assert bench.code(f"RD {','.join(['TIME'] * 9)}") == ErrorCode.OPERAND_ERROR
    bench.do(f"RA {','.join(f'a{n}[]' for n in range(8))}", f"RD {','.join(['TIME'] * 8)}", "RC 1")
    bench.at(1.0)
    assert [bench.value(f"a{n}[1]") for n in range(9)] == [3.0] * 8 + [0.0]


def test_an_array_being_recorded_to_is_not_forgotten() -> None:
    bench = Bench()
    bench.do("DM p[1]", "RA p[]", "RD TIME", "RC 8,-1")
    assert bench.code("DA p[0]") == ErrorCode.RECORDING
    bench.do("RC 0", "DA p[0]")
