"""The DMC command language as syntax: text to `Command` and back, without the effects of commands.

The forms (all of them with or without blanks after the two letters):

| form | example | `Command` |
|---|---|---|
| bare | `LE` | mnemonic |
| mask | `BGAB`, `ST S` | axes |
| implicit | `PA 1,,3`, `PA ?,?` | args, by place |
| explicit | `PAB=1000`, `JG*=0`, `SPB=?` | axes and args |
| segment | `LI 1,2,3<4000>0` | args, speed, end_speed |
| verbatim | `MG "x",_TPA`, `XQ #A,0` | text |
| assignment | `x=5`, `a[0]=9`, `x=?` | mnemonic `=`, text (the name), one arg |

X, Y, Z, W are other names of A to D and are read as such. Numbers are literals; every other argument is stored as
an `Expression`, which is evaluated when the command is executed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from enum import Enum
from math import isfinite
from types import MappingProxyType
from typing import TypeAlias

from dmc41x3.language.codes import ERROR_TEXTS, ErrorCode
from dmc41x3.language.hardware import ALIASES

LINE_LIMIT = 80
"""Longest line [characters], with its `;`, without its CR."""

TOO_LONG = "\x7f"
"""Stands for a command longer than `LINE_LIMIT`; it parses as an error, so its answer is `?`."""

ASSIGN = "="
"""Mnemonic of an assignment or interrogation of a variable."""

CONTROL = MappingProxyType({"^R^V": "\x12\x16", "^R^S": "\x12\x13", "^L^K": "\x0c\x0b"})
"""Commands that consist of two control characters."""


class InvalidCommand(ValueError):
    """A text that is not a command; `code` is its error code for TC."""

    def __init__(self, code: ErrorCode, text: str) -> None:
        self.code = code
        super().__init__(f"{ERROR_TEXTS[code]}: {text!r}")


class Mark(Enum):
    """An argument without a value: left out, or a query."""

    SKIPPED = ""
    QUERY = "?"


SKIPPED = Mark.SKIPPED
QUERY = Mark.QUERY


@dataclass(frozen=True, slots=True)
class Expression:
    """An argument that the controller has to evaluate: `target`, `_TPA+100`, `$FF`, `(a+1)*2`."""

    text: str


Arg: TypeAlias = int | float | Expression | Mark


class ArgumentForm(Enum):
    """Form of the text after a mnemonic."""

    AXES = "letters, or values by axis"
    PLAIN = "values that belong to no axis"
    VERBATIM = "text that the command reads itself"


def _table() -> MappingProxyType[str, ArgumentForm]:
    axes = (
        "AC AD AF AG AL AM AP AR AS AU AV BA BC BD BG BI BL BM BR BT BW BX BZ CA CD CE CM CR CS DC DE DP DV EA EG EM "
        "EQ ER ES ET FA FE FI FL FV GA GD GM GR HM HV IL IP IT JG KD KI KP KS LC LD LE LI LM MC MF MO MR MT NB NF NZ "
        "OA OC OE OF OT OV PA PL PR PT PV QH QR QS RL RP SC SD SH SP ST TD TE TK TL TN TP TS TT TV TW VA VD VE VM VP "
        "VR VS VV YA YB YC YR YS ZA"
    )
    plain = (
        "AB AI AO AQ AT AZ BK BN BP BV CB CC CI CN CW DH DR DT EB EC EI EN EO EP EW EY IA ID IK LA LL LV LZ ME MU MW "
        "OB OP PF QQ QZ RC RE RI RS SB SL SM TA TB TC TH TI TM TR TZ UI UL US VF WH WT ZS"
    )
    verbatim = "CF DA DL DM ED ELSE ENDIF HS HX IF IH II JP JS LS MB MG NO PW QD QU RA RD XQ"
    forms = {ArgumentForm.AXES: axes, ArgumentForm.PLAIN: plain, ArgumentForm.VERBATIM: verbatim}
    return MappingProxyType({name: form for form, names in forms.items() for name in names.split()})


FORMS = _table()
"""Every mnemonic of the DMC-41x3 and how its arguments are read."""

_MODIFIED = frozenset({"LI", "VP", "CR", "IA", "BX", "BZ"})
_TIGHT = frozenset({"IH", "HS"})  # their letter follows at once: IHT=>-3
_LONG = ("ELSE", "ENDIF")

_LETTER = r"(?:[A-IMNSTW-Z]|~[a-h]|\*)"
_MASK = re.compile(f"{_LETTER}+")
_EXPLICIT = re.compile(rf"({_LETTER})\s*=\s*(.*)")
_MODIFIERS = re.compile(r"([^<>]*)(?:<([^<>]*))?(?:>([^<>]*))?")
_ASSIGNMENT = re.compile(r"([A-Za-z~^]\w*(?:\[.*?\])?)\s*=(?!=)\s*(.*)", re.ASCII)
_INTEGER = re.compile(r"[-+]?[0-9]+")
_FRACTION = re.compile(r"[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+)")
_NESTING = re.compile(r'[()\[\]"]')


@dataclass(frozen=True, slots=True)
class Command:
    """One command of the language.

    `axes` are the letters after the mnemonic (`*` is all); with `args` they make the explicit form, without `args`
    they are a mask. `speed` and `end_speed` are the modifiers `<` and `>` of a segment. `text` is the text of a
    verbatim command, or the name in an assignment.
    """

    mnemonic: str
    axes: str = ""
    args: tuple[Arg, ...] = ()
    speed: Arg | None = None
    end_speed: Arg | None = None
    text: str = ""

    def __post_init__(self) -> None:
        if self.args == (SKIPPED,):
            raise ValueError("a single argument that is left out is no argument")

    def format(self) -> str:
        """Return the command's text, without terminator; `parse` reads it back as an equal command.

        Raises `ValueError` for a number that the language cannot write (NaN, infinity).
        """
        body = ",".join(map(_arg_text, self.args))
        if self.mnemonic == ASSIGN:
            return f"{self.text}={body}"
        name = CONTROL.get(self.mnemonic, self.mnemonic)
        if self.text:
            return name + ("" if self.mnemonic in _TIGHT else " ") + self.text
        if self.speed is not None:
            body += f"<{_arg_text(self.speed)}"
        if self.end_speed is not None:
            body += f">{_arg_text(self.end_speed)}"
        if self.axes:
            return f"{name}{self.axes}={body}" if body else name + self.axes
        return f"{name} {body}" if body else name


def split_line(line: str) -> list[str]:
    """Return the commands of a line (without CR): each `;` ends a command, a comment `'` extends to the end.

    A line that ends in `;` has a last empty command, which gets its own prompt.
    """
    commands: list[str] = []
    rest = line
    while not rest.lstrip(" \t").startswith("'"):
        command, semicolon, rest = rest.partition(";")
        commands.append(command.strip(" \t"))
        if not semicolon:
            return commands
    return [*commands, rest.strip(" \t")]


def parse(text: str) -> Command:
    """Return the command in `text`; raises `InvalidCommand` if it contains none.

    The empty text is the empty command. A text that begins with a mnemonic is parsed as that command first, then as an
    assignment.
    """
    text = text.strip(" \t")
    name = next((word for word in _LONG if text.startswith(word)), text[:2])
    form = FORMS.get(name)
    if form is not None:
        return _parse_known(form, name, text)
    if not text:
        return Command("")
    if text[0] == "'":
        return Command("NO", text=text[1:].strip(" \t"))
    for control, characters in CONTROL.items():
        if text == characters:
            return Command(control)
    if (assignment := _assignment(text)) is not None:
        return assignment
    raise InvalidCommand(ErrorCode.INPUT_BUFFER_FULL if text == TOO_LONG else ErrorCode.UNRECOGNIZED_COMMAND, text)


def _parse_known(form: ArgumentForm, name: str, text: str) -> Command:
    rest = text[len(name) :]
    if form is ArgumentForm.VERBATIM:
        return Command(name, text=rest.strip(" \t"))
    body = rest.strip(" \t")
    if not body:
        return Command(name)
    if body[0] == "=":
        raise InvalidCommand(ErrorCode.OPERAND_ERROR, text)
    speed = end_speed = None
    if name in _MODIFIED:
        body, speed, end_speed = _modifiers(body, text)
    if form is ArgumentForm.AXES:
        if found := _EXPLICIT.fullmatch(body):
            axes = found[1].translate(ALIASES)
            return Command(name, axes, _args(found[2], text), speed, end_speed)
        if _MASK.fullmatch(body):
            return Command(name, body.translate(ALIASES), (), speed, end_speed)
    if (assignment := _assignment(text)) is not None:
        return assignment
    return Command(name, "", _args(body, text) if body else (), speed, end_speed)


def _assignment(text: str) -> Command | None:
    found = _ASSIGNMENT.fullmatch(text)
    if found is None:
        return None
    return Command(ASSIGN, text=found[1], args=(_arg(found[2]) if found[2] else QUERY,))


def _modifiers(body: str, text: str) -> tuple[str, Arg | None, Arg | None]:
    found = _MODIFIERS.fullmatch(body)
    if found is None or "" in {found[2], found[3]}:
        raise InvalidCommand(ErrorCode.OPERAND_ERROR, text)
    plain, speed, end_speed = found.groups()
    return (
        plain.strip(" \t"),
        None if speed is None else _modifier(speed, text),
        None if end_speed is None else _modifier(end_speed, text),
    )


def _modifier(part: str, text: str) -> Arg:
    arg = _arg(part)
    if arg is SKIPPED:
        raise InvalidCommand(ErrorCode.OPERAND_ERROR, text)
    return arg


def _args(body: str, text: str) -> tuple[Arg, ...]:
    args = tuple(map(_arg, _split(body)))
    if args == (SKIPPED,):
        raise InvalidCommand(ErrorCode.NOT_ENOUGH_FIELDS, text)
    return args


def _split(body: str) -> list[str]:
    """Split at the commas outside parentheses, brackets and quotes."""
    if not _NESTING.search(body):
        return body.split(",")
    parts, start, depth, quoted = list[str](), 0, 0, False
    for place, character in enumerate(body):
        if character == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif character in "([":
            depth += 1
        elif character in ")]":
            depth -= 1
        elif character == "," and depth <= 0:
            parts.append(body[start:place])
            start = place + 1
    return [*parts, body[start:]]


def _arg(text: str) -> Arg:
    text = text.strip(" \t")
    if not text:
        return SKIPPED
    if text == "?":
        return QUERY
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FRACTION.fullmatch(text):
        return float(text)
    return Expression(text)


def _arg_text(arg: Arg) -> str:
    if isinstance(arg, Expression):
        return arg.text
    if isinstance(arg, Mark):
        return arg.value
    if not isfinite(arg):
        raise ValueError(f"the language has no way to write {arg}")
    text = repr(arg)
    return format(Decimal(text), "f") if "e" in text else text
