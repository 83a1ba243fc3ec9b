"""Every operand that an expression can name, on a controller of three axes just powered up, its motors on."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench

FRESH = [
    ("_TPA _TDA _RPA _DEA _DPA _TEA _TVA _TTA _BGA _MOA _PAA _PRA _IPA _PTA _RLA _ALA _QSA _ZAA", 0),
    ("_SCA", 1),
    ("_TSA", 15),
    ("_LFA _LRA _HMA", 1),
    ("_SPA _JGA _VSS _VST", 25000),
    ("_ACA _DCA _SDA _VAS _VAT _VDS _VDT", 256000),
    ("_HVA", 256),
    ("_FLA", 2147483647),
    ("_BLA", -2147483648),
    ("_ERA", 16384),
    ("_OEA _LDA _CEA _AFA _KIA _TKA", 0),
    ("_MTA _ITA", 1),
    ("_KPA", 6),
    ("_KDA", 64),
    ("_TLA", pytest.approx(9.9982, abs=1e-4)),
    ("_CN _CN0 _CN1 _CN2", -1),
    ("_CN3 _CN4", 0),
    ("_LMS _LMT _LM _CM", 511),
    ("_CSS _CST _CS _AVS _AVT _AV _VMS _VMT _VM _LES _LET _LE _VES", 0),
    ("_VPA _BTA", 0),
    ("_PVA", 255),
    ("_TC _RC _RD _NO _ED0 _ED1 _ZS0 _RS _CA _HX0 _HX7 _WH _IA3 _DR0", 0),
    ("_TB _EO _LZ _AB", 1),
    ("_TI _TI0", 255),
    ("_TI1", 0),
    ("_TI10", 63),
    ("_OP _OP0", 0),
    ("_XQ0 _XQ7", -1),
    ("_DM", 24000),
    ("_DA", 30),
    ("_UL", 510),
    ("_BN", 41330),
    ("_BV _QZ0", 3),
    ("_QZ1", 52),
    ("_QZ2", 26),
    ("_QZ3", 36),
    ("_CF", ord("S")),
    ("_CW", 2),
    ("_TM", 1000),
    ("_PF", 10),
    ("_VF", pytest.approx(10.4, abs=1e-4)),
    ("_IA0", int.from_bytes(bytes((10, 51, 0, 87)), "big")),
    ("_IA1", 250),
    ("_IA2", 7),
    ("_IA4", -1),
    ("_IA5", 100),
    ("_IHA0", 127 * 2**24 + 1),
    ("_IHA1", 1000),
    ("_IHA2", 2),
    ("_IHB0 _IHB1 _IHB2", 0),
    ("_TA0 _TA1 _TA2 _TA3", 0),
    ("TIME", 0),
    ("P2CD P2CH P2NM P2ST", 0),
    ("@IN[1] @IN[8] @IN[81] @IN[86]", 1),
    ("@OUT[1] @AN[1] @AN[8]", 0),
]


def test_operands_after_power_up() -> None:
    expected = {name: value for names, value in FRESH for name in names.split()}
    assert {name: Bench().value(name) for name in expected} == expected


@pytest.mark.parametrize("operand", ["_CO", "_CN5", "_TPD", "_TPS", "_XQ8", "_VSA", "_LMA", "_JS", "_ZZ"])
def test_an_operand_that_there_is_not(operand: str) -> None:
    bench = Bench()
    assert bench.code(f"MG {operand}") == ErrorCode.BAD_OPERAND
    assert bench.code(f"MG {operand}") == ErrorCode.BAD_OPERAND


def test_the_code_is_read_without_forgetting_it() -> None:
    bench = Bench()
    bench.say("nonsense")
    assert [bench.value("_TC"), bench.value("_TC")] == [1, 1]
    assert bench.say("TC;TC") == " 1\r\n: 0\r\n:"


def test_operands_of_a_plane_without_its_letter_are_of_the_selected_one() -> None:
    bench = Bench()
    bench.do("VSS=1000;VST=2000")
    assert bench.value("_VS") == 1000
    bench.do("CAT")
    assert bench.value("_VS") == 2000


def test_inputs_and_outputs() -> None:
    bench = Bench()
    bench.machine.unit.inputs[2] = False
    bench.machine.unit.analog[3] = -2.5
    bench.do("SB 1;SB 8")
    assert (bench.value("_TI0"), bench.say("TI 0")) == (251, " 251\r\n:")
    assert bench.value("@IN[3]") == 0
    assert bench.value("@AN[4]") == -2.5
    assert (bench.value("_OP0"), bench.value("@OUT[8]"), bench.value("@OUT[2]")) == (129, 1, 0)


def test_time_counts_samples() -> None:
    bench = Bench().at(2.5)
    assert bench.value("TIME") == 2560


def test_operands_are_read_every_time() -> None:
    bench = Bench()
    bench.do("JG 1000;BGA")
    assert bench.value("_TPA") == 0
    bench.at(10.0)
    assert bench.value("_TPA") > 9000
    bench.do("x=_TPA*2", "SPB=_BGA+99")
    assert (bench.value("x"), bench.value("_SPB")) == (2 * bench.value("_TPA"), 100)


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        ("PA ?,?,?", " 0, 0, 0\r\n:"),
        ("PA ,?", " 0\r\n:"),
        ("SP 100,?,300", " 25000\r\n:"),
        ("SPB=?", " 25000\r\n:"),
        ("SPY=?", " 25000\r\n:"),
        ("SP B=?", " 25000\r\n:"),
        ("LD*=?", " 0, 0, 0\r\n:"),
        ("JG*=1000;JG*=?", ": 1000, 1000, 1000\r\n:"),
        ("VSS=?", " 25000\r\n:"),
        ("VS ?,?", " 25000, 25000\r\n:"),
        ("KP ?,?", " 6.00, 6.00\r\n:"),
        ("TL ?", " 9.9982\r\n:"),
        ("TT", " 0.0000, 0.0000, 0.0000\r\n:"),
        ("TSA", " 15\r\n:"),
        ("PF ?", " 10.0\r\n:"),
        ("VF ?", " 10.4\r\n:"),
        ("v=$10;SPA=v*2;SPA=?", ":: 32\r\n:"),
        ("DP -5,10;TP", ":-5, 10, 0\r\n:"),
        ("PF 4.1;DP -5,10;TP", "::-5.0, 10.0, 0.0\r\n:"),
        ("PF 3;DP 12345;TPA", ":: 999\r\n:"),
        ("PF -4;DP 255,-1;TPA;TPB", "::$00FF\r\n:$FFFF\r\n:"),
        ("LZ 0;PF 5;TPA", ":: 00000\r\n:"),
        ("VF 4.1;LZ 0;MG 12.34", ":: 0012.3\r\n:"),
        ("VF -8.4;x=-0.5;x=", "::$FFFFFFFF.8000\r\n:"),
    ],
)
def test_forms_of_asking_and_printing(command: str, reply: str) -> None:
    assert Bench().say(command) == reply
