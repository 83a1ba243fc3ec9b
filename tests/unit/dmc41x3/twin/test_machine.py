from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("send", "receive"),
    [
        ("\r", ":"),
        ("\r\n", ":"),
        ("\n\r", ":"),
        ("WH;\r", "IHA\r\n::"),
        ("WH;", "IHA\r\n:"),
        ("WH;WH", "IHA\r\n:"),
        ("wh\r", "?"),
        ("'a comment; all of it\r", ":"),
        ("NO anything\r", ":"),
        ("x=1;nonsense!;x=\r", ":? 1.0000\r\n:"),
        ("MG" + "1" * 80 + "\r", "?"),
        ("EO 1;WH\r", ":IHA\r\n:"),
    ],
)
def test_each_command_yields_its_own_prompt(send: str, receive: str) -> None:
    assert Bench().raw(send).decode() == receive


@pytest.mark.parametrize(
    ("send", "body"),
    [
        ("MG 1,2,-3", " 1.0000 2.0000 -3.0000"),
        ('MG "n",5', "n 5.0000"),
        ('MG "The answer is... ",1234.5278{Z4.2}', "The answer is...  1234.53"),
        ("MG 5{F4.2}", " 0005.00"),
        ("MG 99999{Z3.2}", " 999.99"),
        ("MG 255{$4.0}", "$00FF"),
        ("MG {^65},{^66}", "AB"),
        ('MG "a;b"', None),
        ("MG", ""),
        ("TP", " 0, 0, 0"),
        ("TPB", " 0"),
        ("TP CA", " 0, 0"),
        ("TT A", " 0.0000"),
        ("SP ?,?", " 25000, 25000"),
        ("SPB=?", " 25000"),
        ("SP*=?", " 25000, 25000, 25000"),
        ("BL ?", "-2147483648"),
        ("VS ?", " 25000"),
        ("TI", " 255"),
        ("TA 3", " 0"),
        ("TB", " 1"),
        ("ID", "FW, DMC4133 Rev 1.3k\r\nDMC, 4103, Rev 11"),
        ("CA ?", " 0"),
        ("TS A", " 15"),
    ],
)
def test_formats(send: str, body: str | None) -> None:
    reply = Bench().say(send)
    assert reply == f"{body}\r\n:" if body is not None else reply.startswith("?")


def test_strings_live_in_variables() -> None:
    bench = Bench()
    bench.do('s="hello"')
    assert bench.say("MG s{S3}") == "hel\r\n:"
    assert bench.say('MG "<",s{S},">"') == "<hello>\r\n:"


def test_message_without_line_end() -> None:
    assert Bench().say('MG "x"{N}') == "x:"


def test_position_format_and_leading_zeros() -> None:
    bench = Bench()
    bench.do("PF 6.2")
    assert bench.say("TPA") == " 0.00\r\n:"
    bench.do("LZ 0")
    assert bench.say("TPA") == " 000000.00\r\n:"
    bench.do("VF -4.2")
    assert bench.say("MG 255") == "$00FF.00\r\n:"
    assert bench.say("PF ?") == " 6.2\r\n:"


def test_th_lists_every_handle() -> None:
    lines = Bench().say("TH")[:-3].split("\r\n")
    assert lines[0] == "CONTROLLER IP ADDRESS 10,51,0,87 ETHERNET ADDRESS 00-50-4C-08-01-1F"
    assert lines[1] == "IHA TCP PORT 23 TO IP ADDRESS 127,0,0,1 PORT 1000"
    assert lines[2:] == [f"IH{letter} AVAILABLE" for letter in "BCDEFGH"]


def test_variables_live_until_a_reset() -> None:
    bench = Bench()
    bench.do("hb=TIME", "mayahome=12.5", "hb=hb+1")
    assert bench.value("mayahome*2") == 25.0
    assert bench.say("LV") == "hb= 1.0000\r\nmayahome= 12.5000\r\n:"
    bench.do("DA hb")
    assert bench.code("MG hb") == ErrorCode.VARIABLE_ERROR
    bench.do("RS")
    assert bench.code("MG mayahome") == ErrorCode.VARIABLE_ERROR


def test_burned_variables_and_registers_are_restored() -> None:
    bench = Bench()
    bench.do("keep=3", "BV", "lose=4", "SPA=1000", "CN 1", "BN", "SPA=3000", "RS")
    assert bench.value("keep") == 3.0
    assert bench.code("MG lose") == ErrorCode.VARIABLE_ERROR
    assert bench.value("_SPA") == 1000.0
    assert bench.value("_CN0") == 1.0


def test_reset_equals_power_up() -> None:
    bench = Bench()
    bench.do("SPA=2000;DP 500;SB 1;ZAA=7", "JGA=4000;BGA")
    bench.at(2.0).do("RS")
    assert bench.value("_TPA") == bench.value("_BGA") == bench.value("_ZAA") == 0.0
    assert bench.value("_MOA") == 1.0
    assert bench.value("_SPA") == 25000.0
    assert bench.value("TIME") == 0.0
    assert not bench.plant.outputs[1]
    here = bench.plant.position(0)
    assert bench.plant.timelines[0].at(9.0) == (round(here), 0.0)


def test_time_counts_samples() -> None:
    bench = Bench().at(10.0)
    assert bench.value("TIME") == 10240.0
    bench.at(1 + 2**31 / 1024)
    assert bench.value("TIME") == -(2**31) + 1024


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("XX", ErrorCode.UNRECOGNIZED_COMMAND),
        ("bg", ErrorCode.UNRECOGNIZED_COMMAND),
        ("DM a", ErrorCode.MISSING_BRACKET),
        ("WT 100", ErrorCode.PROGRAM_ONLY),
        ("AMA", ErrorCode.PROGRAM_ONLY),
        ("SP", ErrorCode.NOT_ENOUGH_FIELDS),
        ("SPA=", ErrorCode.NOT_ENOUGH_FIELDS),
        ("SPD=1", ErrorCode.INVALID_AXIS),
        ("SP 1,2,3,4", ErrorCode.OPERAND_ERROR),
        ("SPA=1+", ErrorCode.OPERAND_ERROR),
        ("SPA=15000002", ErrorCode.OUT_OF_RANGE),
        ("ACA=1000", ErrorCode.OUT_OF_RANGE),
        ("OEA=4", ErrorCode.OUT_OF_RANGE),
        ("LDA=-1", ErrorCode.OUT_OF_RANGE),
        ("SB 9", ErrorCode.OUT_OF_RANGE),
        ("OP 256", ErrorCode.OUT_OF_RANGE),
        ("CN 0", ErrorCode.OUT_OF_RANGE),
        ("TPD", ErrorCode.INVALID_AXIS),
        ("TPS", ErrorCode.S_OPERAND_INVALID),
        ("MTA=1", ErrorCode.MOTOR_MUST_BE_OFF),
        ("MG _CO", ErrorCode.BAD_OPERAND),
        ("MG _TPD", ErrorCode.BAD_OPERAND),
        ("MG nope", ErrorCode.VARIABLE_ERROR),
        ("MG (1", ErrorCode.PARENTHESES),
        ('MG "open', ErrorCode.BAD_STRING),
        ("MG 1{Q9}", ErrorCode.BAD_BRACES),
        ("MG 1{F4.2", ErrorCode.BAD_BRACES),
        ("toolongname=1", ErrorCode.VARIABLE_ERROR),
        ("nope=?", ErrorCode.VARIABLE_ERROR),
        ("BGS", ErrorCode.NO_SEQUENCE),
        ("LI 1", ErrorCode.NO_SEQUENCE),
        ("XQ #A", ErrorCode.UNDEFINED_LABEL),
        ("DR 100,1", ErrorCode.HANDLE_MUST_BE_UDP),
        ("IHB=>-3", ErrorCode.HANDLE_CLOSED),
        ("QR D", ErrorCode.INVALID_AXIS),
        ("VD 1000", ErrorCode.OUT_OF_RANGE),
        ("VR 11", ErrorCode.OUT_OF_RANGE),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    assert Bench().code(command) == code


def test_a_refused_command_changes_nothing() -> None:
    bench = Bench()
    bench.code("SP 1000,2000,99999999")
    assert bench.say("SP ?,?,?") == " 25000, 25000, 25000\r\n:"


def test_tc_clears_and_its_operand_does_not() -> None:
    bench = Bench()
    bench.say("XX")
    assert bench.value("_TC") == 1.0
    assert bench.record().error_code == 1
    assert bench.say("TC1").startswith("1 ")
    assert bench.say("TC1") == " 0\r\n:"


@pytest.mark.parametrize(
    ("set_to", "operand", "kept"),
    [
        ("AC 150000", "_ACA", 149504),
        ("VA 20000", "_VAS", 19456),
        ("SP -3001", "_SPA", 3000),
        ("VS 2001", "_VSS", 2000),
        ("VST=500", "_VST", 500),
        ("JG -15001", "_JGA", 15000),
        ("HVA=257", "_HVA", 256),
        ("ZAA=1073741823", "_ZAA", 1073741823),
        ("BLA=-2147483648", "_BLA", -2147483648),
        ("SPY=2000", "_SPB", 2000),
        ("SPX=_SPB/5", "_SPA", 5000),
        ("OE*=1", "_OEC", 1),
    ],
)
def test_registers_are_rounded_as_the_controller_does(set_to: str, operand: str, kept: float) -> None:
    bench = Bench()
    bench.do(set_to)
    assert bench.value(operand) == kept


def test_outputs_reach_the_plant() -> None:
    bench = Bench()
    bench.do("SB 1;OB 2,1;OP 5;CB 1")
    assert bench.plant.outputs == {1: False, 2: False, 3: True}
    assert bench.value("_OP0") == 4.0
    assert bench.value("@OUT[3]") == 1.0
    assert bench.record().output(3)


def test_nine_connections_are_one_too_many() -> None:
    machine = VirtualDmc(BenchPlant())
    handles = [machine.connect(("127.0.0.1", port)) for port in range(8)]
    assert [handle.letter for handle in handles if handle] == list("ABCDEFGH")
    assert machine.connect(("127.0.0.1", 9)) is None
    assert handles[2] is not None
    machine.disconnect(handles[2])
    again = machine.connect(("127.0.0.1", 10))
    assert again is not None
    assert again.letter == "C"


def test_iht_closes_the_others_and_ihs_oneself() -> None:
    bench = Bench()
    other = bench.connect()
    assert bench.say("IHT=>-1") == ":"
    assert other.open
    assert bench.say("IHT=>-3") == ":"
    assert not other.open
    assert bench.machine.receive(other, b"WH\r", 0.0) == b""
    assert bench.value("_IA2") == 7.0
    assert bench.say("IHS=>-2;WH") == ":"
    assert not bench.handle.open


def test_a_message_may_go_to_another_handle() -> None:
    bench = Bench()
    other = bench.connect()
    bench.do("CW 1", 'MG {EB}"L"')
    assert bench.machine.take_messages() == [(other, b"\xcc\x8d\x8a")]
    assert bench.machine.take_messages() == []


def test_each_handle_keeps_its_own_half_command() -> None:
    bench = Bench()
    other = bench.connect()
    assert bench.raw("W") == b""
    assert bench.machine.receive(other, b"WH\r", 0.0) == b"IHB\r\n:"
    assert bench.raw("H\r") == b"IHA\r\n:"


@pytest.mark.parametrize("axes", range(1, 9))
def test_one_to_eight_axes(axes: int) -> None:
    bench = Bench(axes)
    assert bench.say("QZ") == f" {axes}, 52, 26, 36\r\n:"
    assert len(bench.raw("QR\r")) == 4 + 52 + 26 + 36 * axes + 1
    assert len(bench.positions()) == axes
    assert bench.value("_BV") == axes


@given(st.lists(st.binary(max_size=100), max_size=5), st.floats(0, 5))
def test_no_bytes_make_it_raise(pieces: list[bytes], step: float) -> None:
    machine = VirtualDmc(BenchPlant())
    handle = machine.connect(("127.0.0.1", 1))
    assert handle is not None
    for number, data in enumerate(pieces):
        machine.receive(handle, data, number * step)


_NAMES = """
    SH MO BG ST AB PA PR JG SP AC DC IP DP LM LI LE CS VS VA VD VR CA CN LD FL BL ER OE FE FI HM PT TP QR MG RS CW
"""
_WORDS = st.sampled_from(_NAMES.split())
_TAILS = st.text(alphabet="ABCST=?,<>-0123456789. *_", max_size=14)


@given(st.lists(st.tuples(_WORDS, _TAILS, st.floats(0, 3)), max_size=30))
def test_no_sequence_of_commands_makes_it_raise(commands: list[tuple[str, str, float]]) -> None:
    bench = Bench()
    for word, tail, pause in commands:
        bench.at(bench.now + pause).raw(f"{word}{tail}\r")
    for axis in bench.record().axes:
        assert axis.error == axis.reference - axis.position
