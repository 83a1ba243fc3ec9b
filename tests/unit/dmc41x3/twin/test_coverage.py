"""The twin's description of its language, against its behaviour and against the bare facts of the language.

`tests/vectors/dmc41x3_commands.json` holds the facts: who may use an entry, whether it answers `?`, whether it is an
operand. Every entry has an example here that the twin must take.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TypedDict

import pytest

from dmc41x3.language.catalogue import CATALOGUE, EntryKind
from dmc41x3.language.commands import CONTROL
from dmc41x3.twin.commands import COVERAGE, TABLE, CoverageClass, covered
from tests.unit.dmc41x3.twin.bench import Bench
from tests.unit.dmc41x3.twin.program_bench import ProgramBench


class Fact(TypedDict):
    """One entry of the vectors."""

    mnemonic: str
    kind: str
    valid_in: str
    valid_moving: bool
    takes_query: str
    has_operand: bool


VECTORS = Path(__file__).parents[3] / "vectors" / "dmc41x3_commands.json"
FACTS: dict[str, Fact] = {fact["mnemonic"]: fact for fact in json.loads(VECTORS.read_text(encoding="utf-8"))}

_COMMANDS = (EntryKind.COMMAND, EntryKind.TRIPPOINT)

EXAMPLES = {
    "^L^K": "PW abc,abc;\x0c\x0babc,1",
    "^R^S": "\x12\x13",
    "^R^V": "\x12\x16",
    "AC": "AC 2048",
    "AG": "MO;AG 2",
    "AQ": "AQ 1,2",
    "AU": "MO;AU 1",
    "BD": "BAA;BDA=90",
    "BI": "BAA;BIA=0",
    "BM": "BAA;BMA=1000",
    "BT": "PVA=100,0,64;PVA=0,0,0;BTA",
    "BX": "BAA;BXA=2",
    "BZ": "BAA;BZA=-2<200>100",
    "CA": "CA T",
    "CD": "CMA;DT 1;CD 5",
    "CR": "VMAB;CR 100,0,90",
    "DA": "x=1;DA x",
    "DC": "DC 2048",
    "DM": "DM a[5]",
    "EB": "EMN=100;EB 1",
    "EG": "EMN=100;EB 1;EGA=5",
    "EQ": "EMN=100;EB 1;EQA=5",
    "ES": "VMAB;ES 1,2",
    "GA": "GA ,A",
    "HS": "HSA=B",
    "IA": "DH 0;IA 10,0,0,9",
    "IH": "IHT=>-1",
    "LI": "LM A;LI 100",
    "MT": "MO;MT -1",
    "OB": "OB 1,1",
    "OT": "OT 40",
    "PL": "PL 0.5",
    "PV": "PVA=100,0,64",
    "PW": "PW abc,abc",
    "QU": "DM a[2];QU a[]",
    "RA": "DM a[2];RA a[]",
    "RD": "RD _TPA",
    "SD": "SD 2048",
    "TM": "TM 500",
    "VA": "VA 2048",
    "VD": "VD 2048",
    "VM": "VMAB",
    "VP": "VMAB;VP 10,20",
    "VS": "VS 2000",
    "YR": "MO;MTA=2;SH;YRA=5",
}
"""Commands of a host; the last one is the subject. Others are taken with one of the plain forms."""

PROGRAMS = {
    "AD": "PRA=1000;BGA;AD 50",
    "AI": "AI 1",
    "AM": "PRA=100;BGA;AM A",
    "AP": "PRA=1000;BGA;AP 500",
    "AR": "PRA=1000;BGA;AR 50",
    "AS": "JGA=1000;BGA;AS A",
    "AT": "AT 0;AT 20",
    "AV": "LM A;LI 1000;LE;BGS;AV 100",
    "ELSE": "IF (1=2);HX;ELSE;NO;ENDIF",
    "EN": "IF (1=2);EN;ENDIF",
    "ENDIF": "IF (1=1);NO;ENDIF",
    "IF": "IF (1=1);NO;ENDIF",
    "JP": "JP #ON,(1=2)",
    "JS": "JS #SUB",
    "MC": "PRA=100;BGA;MC A",
    "MF": "PRA=1000;BGA;MF 500",
    "MR": "PRA=-1000;BGA;MR -500",
    "WT": "WT 2",
    "ZS": "ZS",
    "& (JS arg)": "x=1;JS #SUB(&x)",
    "^a..^h": "JS #SUB(7)",
    "#": "NO",
}
"""Commands of a program before its subject."""

CONVERSATIONS = {
    "DL": ("DL\r#A;EN\r\\", "::"),
    "ED": ("ED\r\x11\r", ":::"),
    "QD": ("DM a[2]\rQD a[]\r1,2\r\\", ":::"),
    "XQ": ("DL\r#A;EN\r\\XQ #A\r", ":::"),
    "LS": ("DL\r#A;EN\r\\LS\r", "::0 #A;EN\r\n:"),
}
"""Exchanges byte by byte."""

IN_A_ROUTINE = frozenset({"RE", "RI"})

EXPRESSIONS = {
    "( )": ("2*(1+2)", 6.0),
    "-": ("5-7", -2.0),
    "*": ("2*3", 6.0),
    "/": ("3/2", 1.5),
    "&": ("6&3", 2.0),
    "%": ("7%4", 3.0),
    "+": ("1+2", 3.0),
    "<": ("1<2", 1.0),
    "<=": ("3<=2", 0.0),
    "<>": ("1<>2", 1.0),
    "=": ("2=2", 1.0),
    ">": ("1>2", 0.0),
    ">=": ("2>=2", 1.0),
    "|": ("6|3", 7.0),
    "$": ("$1F", 31.0),
    "[ ]": ("a[-1]", 3.0),
    "= (assign)": ("v", 4.0),
    "~a..~h": ("~a", 1.0),
    "@ABS": ("@ABS[-2]", 2.0),
    "@ACOS": ("@ACOS[0]", 90.0),
    "@AN": ("@AN[1]", 0.0),
    "@ASIN": ("@ASIN[1]", 90.0),
    "@ATAN": ("@ATAN[1]", 45.0),
    "@COM": ("@COM[0]", -1.0),
    "@COS": ("@COS[60]", 0.5),
    "@FLOT": ("@REAL[@FLOT[2.5]]", 2.5),
    "@FRAC": ("@FRAC[-1.25]", -0.25),
    "@IN": ("@IN[1]", 1.0),
    "@INT": ("@INT[-1.75]", -1.0),
    "@OUT": ("@OUT[1]", 0.0),
    "@REAL": ("@REAL[@FLOT[-3]]", -3.0),
    "@RND": ("@RND[1.5]", 2.0),
    "@SIN": ("@SIN[30]", 0.5),
    "@SQR": ("@SQR[9]", 3.0),
    "@TAN": ("@TAN[45]", 1.0),
    "TIME": ("TIME", 0.0),
    "P2CD": ("P2CD", 0.0),
    "P2CH": ("P2CH", 0.0),
    "P2NM": ("P2NM", 0.0),
    "P2ST": ("P2ST", 0.0),
    "_GPm": ("_GPA", 0.0),
    "_LFm": ("_LFA", 1.0),
    "_LRm": ("_LRA", 1.0),
}

QUERIES = {"IH": "IHA=?", "IA": "IA ?", "^L^K": "\x0c\x0b?"}
OPERANDS = {"IH": "_IHA0", "AQ": "_AQ1", "TIME": "TIME", "_GPm": "_GPA", "_LFm": "_LFA", "_LRm": "_LRA"}
IN_PROGRAMS_ONLY = frozenset({"JS"})


def of(kind: CoverageClass, *kinds: EntryKind) -> list[str]:
    """Return the names of a class and of kinds of entries."""
    return [name for name, entry in CATALOGUE.items() if COVERAGE[name].kind is kind and entry.kind in kinds]


def word(name: str) -> str:
    """Return what is sent for a command."""
    return CONTROL.get(name, name)


def forms(name: str) -> list[str]:
    """Return ways of giving a command that most take one of."""
    return [f"{word(name)}A=1", f"{word(name)} 1", f"{word(name)}A", word(name)]


def taken(name: str) -> bool:
    """Tell whether a host's command is obeyed in one form."""
    if name in EXAMPLES:
        *before, last = EXAMPLES[name].split(";")
        bench = Bench()
        for line in before:
            assert bench.say(line).endswith(":"), line
        return bench.raw(f"{last}\r")[-1:] == b":"
    return any(Bench().raw(f"{form}\r")[-1:] == b":" for form in forms(name))


def test_the_catalogue_has_the_entries_of_the_language() -> None:
    assert list(CATALOGUE) == list(FACTS)
    for name, fact in FACTS.items():
        assert CATALOGUE[name].kind.value == fact["kind"], name
        assert CATALOGUE[name].where.value == fact["valid_in"], name


def test_every_entry_has_its_own_words() -> None:
    purposes = [entry.purpose for entry in CATALOGUE.values()]
    assert all(purposes)
    assert len(set(purposes)) == len(purposes)


def test_every_entry_is_classified_and_says_why_it_is_not_implemented() -> None:
    assert set(COVERAGE) == set(CATALOGUE)
    for name, coverage in COVERAGE.items():
        assert bool(coverage.reason) is (coverage.kind is not CoverageClass.IMPLEMENTED), name
        assert (coverage.code is not None) is (coverage.kind is CoverageClass.REFUSED), name


def test_four_fifths_of_the_language_are_implemented() -> None:
    assert covered() >= 0.8


def test_every_command_has_a_handler_and_every_handler_a_command() -> None:
    named = {word(name)[:2] for kind in CoverageClass for name in of(kind, *_COMMANDS)}
    assert named <= set(TABLE)
    assert set(TABLE) <= named


def test_every_command_is_obeyed_in_some_form() -> None:
    names = [
        name
        for kind in (CoverageClass.IMPLEMENTED, CoverageClass.ACCEPTED)
        for name in of(kind, *_COMMANDS)
        if name not in PROGRAMS | CONVERSATIONS and name not in IN_A_ROUTINE | {"SL"}
    ]
    assert names
    assert [name for name in names if not taken(name)] == []


@pytest.mark.parametrize("name", PROGRAMS)
def test_program_runs_commands_of_programs(name: str) -> None:
    bench = ProgramBench()
    lines = PROGRAMS[name].replace(";", "\n")
    assert bench.run(3.0, f'#A\n{lines}\n#ON\nMG "on"\nEN\n#SUB\nEN') == ["on"]


@pytest.mark.parametrize("name", [*(set(PROGRAMS) & set(TABLE)), *IN_A_ROUTINE])
def test_host_cannot_run_commands_of_programs(name: str) -> None:
    if FACTS[name]["valid_in"] == "program":
        assert Bench().code(f"{name} 1") == 2


@pytest.mark.parametrize(("routine", "command", "cause"), [("LIMSWI", "RE", "CN 1"), ("ININT", "RI", "II 1")])
def test_a_routine_ends_with_its_own_command(routine: str, command: str, cause: str) -> None:
    bench = ProgramBench(f'#{routine}\nMG "in"\n{command}')
    bench.do("JGA=1000;BGA")
    bench.at(1.0).do(cause)
    bench.machine.unit.set_input(1, False)
    bench.machine.look()
    bench.at(1.5)
    assert bench.said()[:1] == ["in"]
    assert bench.at(2.0).state() == 0


def test_program_at_a_breakpoint_continues_line_by_line() -> None:
    bench = ProgramBench("#A\nNO\nNO\nEN")
    bench.do("BK 1", "XQ #A")
    bench.at(1.0).do("SL")
    assert bench.at(2.0).place() == 2


@pytest.mark.parametrize("name", CONVERSATIONS)
def test_a_conversation_goes_as_it_should(name: str) -> None:
    said, answered = CONVERSATIONS[name]
    assert Bench().raw(said).decode("latin-1") == answered


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_an_expression_has_its_value(name: str) -> None:
    bench = Bench()
    bench.do("DM a[3]", "v=4", "~a=1")
    expression, value = EXPRESSIONS[name]
    assert bench.value(expression) == value


def test_nothing_of_the_language_goes_without_an_example() -> None:
    spoken = {name for name in CATALOGUE if CATALOGUE[name].kind in _COMMANDS}
    written = {";", "'", "REM"}
    routines = {name for name in CATALOGUE if CATALOGUE[name].kind is EntryKind.ROUTINE}
    assert set(CATALOGUE) == spoken | written | routines | set(EXPRESSIONS) | set(PROGRAMS)


def test_commands_are_separated_and_remarks_ignored() -> None:
    assert Bench().say("SP 2;MG _SPA;'SP 4") == ": 2.0000\r\n::"


def test_an_assignment_is_asked_by_a_question_mark() -> None:
    bench = Bench()
    bench.do("v=4")
    assert bench.say("v=?") == " 4.0000\r\n:"


def test_question_marks_are_answered() -> None:
    for name in [name for name, fact in FACTS.items() if fact["takes_query"] != "no" and name != "= (assign)"]:
        asked = [QUERIES[name]] if name in QUERIES else [f"{word(name)} ?", f"{word(name)}A=?"]
        assert any(Bench().say(question).endswith("\r\n:") for question in asked), name


def test_operands_in_programs_have_a_value() -> None:
    for name in IN_PROGRAMS_ONLY:
        assert ProgramBench().run(0.5, f"#A\nMG _{name}\nEN") == ["0.0000"], name


def test_operands_have_a_value() -> None:
    for name in [name for name, fact in FACTS.items() if fact["has_operand"] and name not in IN_PROGRAMS_ONLY]:
        tried = [OPERANDS[name]] if name in OPERANDS else [f"_{name}{which}" for which in ("", "0", "A", "S")]
        tried = [name] if name in EXPRESSIONS and name not in OPERANDS else tried
        assert any(Bench().say(f"MG {operand}").endswith("\r\n:") for operand in tried), name


@pytest.mark.parametrize("name", of(CoverageClass.REFUSED, *_COMMANDS, EntryKind.KEYWORD))
def test_refusals_have_their_codes(name: str) -> None:
    bench = Bench()
    bench.do("BAA")
    assert bench.code(f"{word(name)}{'A' if name == 'BC' else ' 1'}") == COVERAGE[name].code


@pytest.mark.parametrize("name", [name for name in of(CoverageClass.ACCEPTED, *_COMMANDS) if name != "QH"])
def test_command_without_effect_is_noted_once(name: str) -> None:
    notes: list[str] = []
    for form in [EXAMPLES[name]] if name in EXAMPLES else forms(name):
        bench = Bench()
        bench.machine.unit.on_note = notes.append
        bench.say(form)
        bench.say(form)
        if notes:
            break
    assert len([note for note in notes if note.startswith(f"{name} has no effect")]) == 1
    assert COVERAGE[name].reason in notes[-1]
