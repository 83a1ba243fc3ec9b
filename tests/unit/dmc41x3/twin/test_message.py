"""MG: formats of values and texts, and where they go."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("message", "printed"),
    [
        ("1", " 1.0000"),
        ("-12.5", "-12.5000"),
        ("12345678.9101", " 12345678.9101"),
        ("1+2*3", " 9.0000"),
        ("0,1,2", " 0.0000 1.0000 2.0000"),
        ("1 , -2", " 1.0000 -2.0000"),
        ("2147483647", " 2147483647.0000"),
        ("-2147483648", "-2147483648.0000"),
        ("1234.5678{F4.2}", " 1234.57"),
        ("1234.5678{Z4.0}", " 1235"),
        ("5{F4.2}", " 0005.00"),
        ("5{Z4.2}", " 5.00"),
        ("-5{F4.2}", "-0005.00"),
        ("10000{F4.2}", " 9999.99"),
        ("-10000{Z4.2}", "-9999.99"),
        ("0.5{F10.4}", " 0000000000.5000"),
        ("255{$4}", "$00FF"),
        ("255{$8.4}", "$000000FF.0000"),
        ("-1{$8.4}", "$FFFFFFFF.0000"),
        ('"text"', "text"),
        ('"a","b"', "ab"),
        ('"a" , "b"', "ab"),
        ('"x",1', "x 1.0000"),
        ('1,"x"', " 1.0000x"),
        ('"x is ",v{Z3.1}," V"', "x is  7.5 V"),
        ("v{F2.1},v", " 07.5 7.5000"),
        ("{^72},{^105}", "Hi"),
        ("{^$41}", "A"),
        ('""', ""),
        ("word{S}", "abcdef"),
        ("word{S6}", "abcdef"),
        ("word{S2}", "ab"),
        ('"<",word{S1},">"', "<a>"),
        ("TIME,_TPA", " 0.0000 0.0000"),
    ],
)
def test_message_output(message: str, printed: str) -> None:
    bench = Bench()
    bench.do("v=7.5", 'word="abcdef"')
    assert bench.say(f"MG {message}") == f"{printed}\r\n:"


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ('"open', ErrorCode.BAD_STRING),
        ('1,"open', ErrorCode.BAD_STRING),
        ("1{F4.2", ErrorCode.BAD_BRACES),
        ("1}", ErrorCode.BAD_BRACES),
        ("{F4.2}", ErrorCode.BAD_BRACES),
        ('"x"{F4.2}', ErrorCode.BAD_BRACES),
        ("1{Q}", ErrorCode.BAD_BRACES),
        ("1{F}", ErrorCode.BAD_BRACES),
        ("1{F0.0}", ErrorCode.BAD_BRACES),
        ("1{F11.0}", ErrorCode.BAD_BRACES),
        ("1{F4.5}", ErrorCode.BAD_BRACES),
        ("1{$9}", ErrorCode.BAD_BRACES),
        ("1{S7}", ErrorCode.BAD_BRACES),
        ("{^256}", ErrorCode.OUT_OF_RANGE),
        ("{^-1}", ErrorCode.OUT_OF_RANGE),
        ("nope", ErrorCode.VARIABLE_ERROR),
        ('{EB}"x"', ErrorCode.HANDLE_CLOSED),
        ('{EZ}"x"', ErrorCode.HANDLE_CLOSED),
    ],
)
def test_misuse_has_its_code(message: str, code: ErrorCode) -> None:
    assert Bench().code(f"MG {message}") == code


def test_a_message_without_line_end() -> None:
    assert Bench().say('MG "x",1{N}') == "x 1.0000:"
    assert Bench().say("MG {N}") == ":"


def test_a_bare_message_is_an_empty_line() -> None:
    assert Bench().say("MG") == "\r\n:"


@pytest.mark.parametrize("port", ["P1", "P2"])
def test_a_serial_port_leads_nowhere(port: str) -> None:
    bench = Bench()
    assert bench.say(f'MG {{{port}}}"x"') == ":"
    assert bench.machine.take_messages() == []


@pytest.mark.parametrize(("mark", "data"), [(1, b"\xe8\xe9\x8d\x8a"), (2, b"hi\r\n")])
def test_a_message_for_another_handle_is_marked_as_cw_says(mark: int, data: bytes) -> None:
    bench = Bench()
    other = bench.connect()
    bench.do(f"CW {mark}")
    assert bench.say('MG {EB}"hi"') == ":"
    assert bench.machine.take_messages() == [(other, data)]


def test_the_value_format_is_vf_and_leading_zeros_are_lz() -> None:
    bench = Bench()
    bench.do("VF 4.1")
    assert bench.say("MG 12.34,-1") == " 12.3 -1.0\r\n:"
    bench.do("LZ 0")
    assert bench.say("MG 12.34,-1") == " 0012.3 -0001.0\r\n:"
    bench.do("VF -4.0", "LZ 1")
    assert bench.say("MG 255,256") == "$00FF $0100\r\n:"
