"""Arguments and expressions of commands, evaluated as a DMC does: left to right, in 32.16 fixed point.

A raw value is the number times 65536, as an integer of 48 bits. Products and quotients are truncated towards zero; a
result beyond the range wraps as the registers do. A function without a result is refused with code 6: division
by zero, an angle whose tangent is too large. The manual does not document these cases; nothing above relies on them.

A text is compiled once and evaluated many times, for example in loops of programs. A misspelled text is refused
before any name is looked up.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import Protocol, TypeAlias

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.hardware import ALIASES
from dmc41x3.language.numbers import RAW_MAX, RAW_MIN, SCALE, fits, parse_fixed


class Rejection(Exception):
    """A command is refused with `?`; `code` is the code that TC then reports."""

    def __init__(self, code: ErrorCode) -> None:
        self.code = code
        super().__init__(code.name)


ONE = SCALE
STRING_LENGTH = 6
"""A string occupies the six bytes of a number."""

SPAN = 1 << 48
_HALF = 1 << 47
_TURN = 360 * ONE


def wrap(raw: int) -> int:
    """Return a raw value folded into 48 bits."""
    return raw if RAW_MIN <= raw <= RAW_MAX else (raw + _HALF) % SPAN - _HALF


def whole(raw: int) -> int:
    """Return the number that a raw value stands for, without its fraction."""
    return raw // ONE if raw >= 0 else -(-raw // ONE)


def pack(text: str) -> int:
    """Return a string of up to six characters as a raw value; raises `Rejection` for a longer one."""
    if len(text) > STRING_LENGTH or not text.isascii():
        raise Rejection(ErrorCode.BAD_STRING)
    return wrap(int.from_bytes(text.encode("ascii").ljust(STRING_LENGTH, b"\0"), "big"))


def unpack(raw: int, length: int = STRING_LENGTH) -> str:
    """Return the first `length` characters of the string in a raw value; unprintable bytes are left out."""
    data = (raw % SPAN).to_bytes(STRING_LENGTH, "big")[:length]
    return "".join(chr(byte) for byte in data if 0x20 <= byte < 0x7F)


def _product(a: int, b: int) -> int:
    size = abs(a) * abs(b) >> 16
    return wrap(size if (a < 0) == (b < 0) else -size)


def _quotient(a: int, b: int) -> int:
    if b == 0:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    size = (abs(a) << 16) // abs(b)
    return wrap(size if (a < 0) == (b < 0) else -size)


def _modulo(a: int, b: int) -> int:
    """Return the remainder, which has the sign of the dividend."""
    if b == 0:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    size = abs(a) % abs(b)
    return size if a >= 0 else -size


OPERATORS: dict[str, Callable[[int, int], int]] = {
    "+": lambda a, b: wrap(a + b),
    "-": lambda a, b: wrap(a - b),
    "*": _product,
    "/": _quotient,
    "%": _modulo,
    "&": lambda a, b: a & b,
    "|": lambda a, b: a | b,
    "=": lambda a, b: ONE if a == b else 0,
    "<>": lambda a, b: ONE if a != b else 0,
    "<": lambda a, b: ONE if a < b else 0,
    ">": lambda a, b: ONE if a > b else 0,
    "<=": lambda a, b: ONE if a <= b else 0,
    ">=": lambda a, b: ONE if a >= b else 0,
}
"""Operators on raw values in range, with results in range. `&` and `|` take all 48 bits."""


def _rounded(a: int) -> int:
    """Return the nearest whole number, halves upwards: 5.5 gives 6, -5.5 gives -5 (Galil's command reference, @RND)."""
    return wrap((a + ONE // 2) // ONE * ONE)


def _real(function: Callable[[float], float]) -> Callable[[int], int]:
    """Return a function of floats as one of raw values, rounded; outside its domain it raises `Rejection` (6)."""

    def apply(a: int) -> int:
        try:
            result = function(a / ONE)
        except ValueError:
            raise Rejection(ErrorCode.OUT_OF_RANGE) from None
        return round(result * ONE)

    return apply


def _sine(a: int) -> int:
    # Whole turns are removed while the angle is exact.
    return round(math.sin(math.radians(a % _TURN / ONE)) * ONE)


def _cosine(a: int) -> int:
    return round(math.cos(math.radians(a % _TURN / ONE)) * ONE)


def _tangent(a: int) -> int:
    """Return the tangent; from 45 to 135 degrees by that of the complement, which is exact for large tangents."""
    angle = a % (_TURN // 2)
    if _TURN // 8 <= angle <= 3 * _TURN // 8:
        complement = math.tan(math.radians((_TURN // 4 - angle) / ONE))
        if complement == 0.0:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        return round(ONE / complement)
    return round(math.tan(math.radians(angle / ONE)) * ONE)


def _to_float_bits(a: int) -> int:
    """Return the bits of the nearest IEEE single as a whole number (@FLOT)."""
    return int.from_bytes(struct.pack(">f", a / ONE), "big", signed=True) * ONE


def _from_float_bits(a: int) -> int:
    """Return the number, truncated to 1/65536, of an IEEE single given by its bits (@REAL)."""
    (value,) = struct.unpack(">f", (a // ONE).to_bytes(4, "big", signed=True))
    if math.isnan(value) or not fits(value):
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return int(value * ONE)


FUNCTIONS: dict[str, Callable[[int], int]] = {
    "SIN": _sine,
    "COS": _cosine,
    "TAN": _tangent,
    "ASIN": _real(lambda x: math.degrees(math.asin(x))),
    "ACOS": _real(lambda x: math.degrees(math.acos(x))),
    "ATAN": _real(lambda x: math.degrees(math.atan(x))),
    "SQR": _real(lambda x: math.sqrt(abs(x))),
    "ABS": lambda a: wrap(abs(a)),
    "INT": lambda a: whole(a) * ONE,
    "FRAC": lambda a: a - whole(a) * ONE,
    "RND": _rounded,
    "COM": lambda a: ~(a // ONE) * ONE,
    "FLOT": _to_float_bits,
    "REAL": _from_float_bits,
}
"""Functions `@NAME[...]` of one raw value: angles in degrees, roots of the absolute value, @COM of the whole bits."""


AXIS_NAMES = "ABCDEFGHSTNM"
"""Meanings of the values 0 to 11 of an axis variable `~a`."""

KEYWORDS = frozenset({"TIME", "P2CD", "P2CH", "P2NM", "P2ST"})
"""Operands written without an underscore."""

_DEEPEST = 100
_CACHED = 4096
_NUMBER = re.compile(r"\s*([0-9]+\.?[0-9]*|\.[0-9]+|\$[0-9A-Fa-f]{1,8}(?:\.[0-9A-Fa-f]{1,4})?)")
_WORD = re.compile(r"\s*(@[A-Z]+|_[A-Z0-9]+(?:~[a-h])?|[~^][a-h](?![A-Za-z0-9])|[A-Za-z][A-Za-z0-9_]*)")
_STRING = re.compile(r'\s*"([^"]*)"')
_OPERATOR = re.compile(r"\s*(<=|>=|<>|[-+*/%&|=<>])")
_SYMBOL = re.compile(r"\s*([-(\[\])])")
_WRONG = {"?": ErrorCode.QUESTION_MARK_INVALID, '"': ErrorCode.BAD_STRING}
"""Error codes of a term by its first character; only quotes that are not closed occur here."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,7}")


class Scope(Protocol):
    """Source of the names in an expression; every value is raw fixed point."""

    def variable(self, name: str) -> int:
        """Return a variable, also `~a` or `^a`; raises `Rejection` if it was never assigned."""
        ...

    def element(self, name: str, index: int) -> int:
        """Return an element of an array, or its length for index -1; raises `Rejection` if it does not exist."""
        ...

    def operand(self, name: str) -> int:
        """Return an operand such as `TPA` (written `_TPA`), or a keyword; raises `Rejection` for an unknown name."""
        ...

    def bank(self, function: str, bit: int) -> int:
        """Return `@IN[bit]`, `@OUT[bit]` or `@AN[bit]`; raises `Rejection` for a bit that does not exist."""
        ...


Value: TypeAlias = Callable[[Scope], int]
"""A compiled expression; raises `Rejection` if a name is unknown or a result cannot be computed."""


def evaluate(text: str, scope: Scope) -> int:
    """Return the raw value of an expression; raises `Rejection` with the code of the error."""
    if len(text) < 10 and text.isascii() and (text.isdecimal() or (text[:1] == "-" and text[1:].isdecimal())):
        return int(text) * ONE
    return compiled(text)(scope)


@lru_cache(_CACHED)
def compiled(text: str) -> Value:
    """Return a compiled expression; raises `Rejection` if it is misspelled."""
    if not text.strip():
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    parser = _Parser(text)
    value = parser.expression()
    parser.finish()
    return value


def is_name(text: str) -> bool:
    """Return whether a text is a valid name: a letter, then letters, digits, underscores, eight characters at most.

    Galil's command reference names letters and digits only; programs in use have underscores too (ISIS, galil_*.dmc).
    """
    return _NAME.fullmatch(text) is not None


def axis_letter(scope: Scope, variable: str) -> str:
    """Return the axis or plane that a variable `~a` stands for; raises `Rejection` if it was never assigned."""
    return AXIS_NAMES[whole(scope.variable(variable))]


class _Parser:
    """Reads one expression by recursive descent; all operators have the same precedence."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._depth = 0

    def expression(self) -> Value:
        first = self._term()
        steps: list[tuple[Callable[[int, int], int], Value]] = []
        while (operator := self._match(_OPERATOR)) is not None:
            steps.append((OPERATORS[operator], self._term()))
        if not steps:
            return first
        return _one_step(first, *steps[0]) if len(steps) == 1 else _steps(first, steps)

    def finish(self) -> None:
        rest = self._text[self._at :].strip()
        if rest:
            raise Rejection(ErrorCode.PARENTHESES if rest[0] in "()" else ErrorCode.OPERAND_ERROR)

    def _match(self, pattern: re.Pattern[str]) -> str | None:
        found = pattern.match(self._text, self._at)
        if found is None:
            return None
        self._at = found.end()
        return found[1]

    def _term(self) -> Value:
        number = self._match(_NUMBER)
        if number is not None:
            return _constant(_literal(number))
        word = self._match(_WORD)
        if word is not None:
            return self._named(word)
        string = self._match(_STRING)
        if string is not None:
            return _constant(pack(string))
        symbol = self._match(_SYMBOL)
        if symbol == "-":
            return self._negative()
        if symbol == "(":
            return self._enclosed(")", ErrorCode.PARENTHESES)
        raise Rejection(_WRONG.get(self._text[self._at :].lstrip()[:1], ErrorCode.OPERAND_ERROR))

    def _negative(self) -> Value:
        number = self._match(_NUMBER)
        if number is not None:
            # The sign is part of a decimal; otherwise -2147483648 could not be written.
            return _constant(wrap(-_literal(number)) if "$" in number else _literal(f"-{number}"))
        value = self._nested(self._term)
        return lambda scope: wrap(-value(scope))

    def _named(self, word: str) -> Value:
        if word[0] == "@":
            return self._function(word[1:])
        if word[0] == "_":
            return _operand(word[1:])
        if self._text.startswith("[", self._at):
            self._at += 1
            if self._text.startswith("]", self._at):
                raise Rejection(ErrorCode.INDEX_OUT_OF_RANGE)
            index = self._enclosed("]", ErrorCode.MISSING_BRACKET)
            return lambda scope: scope.element(word, whole(index(scope)))
        if word in KEYWORDS:
            return _operand(word)
        return lambda scope: scope.variable(word)

    def _function(self, name: str) -> Value:
        if self._match(_SYMBOL) != "[":
            raise Rejection(ErrorCode.MISSING_BRACKET)
        value = self._enclosed("]", ErrorCode.MISSING_BRACKET)
        if name in ("IN", "OUT", "AN"):
            return lambda scope: scope.bank(name, whole(value(scope)))
        function = FUNCTIONS.get(name)
        if function is None:
            raise Rejection(ErrorCode.BAD_FUNCTION)
        return lambda scope: function(value(scope))

    def _enclosed(self, end: str, missing: ErrorCode) -> Value:
        value = self._nested(self.expression)
        if self._match(_SYMBOL) != end:
            raise Rejection(missing)
        return value

    def _nested(self, read: Callable[[], Value]) -> Value:
        # A line has 80 characters, so no command reaches this bound; it protects the stack from other texts.
        self._depth += 1
        if self._depth > _DEEPEST:
            raise Rejection(ErrorCode.PARENTHESES)
        value = read()
        self._depth -= 1
        return value


def _constant(raw: int) -> Value:
    return lambda _: raw


def _operand(name: str) -> Value:
    word, tilde, variable = name.partition("~")
    if not tilde:
        return lambda scope: scope.operand(name)
    return lambda scope: scope.operand(word + axis_letter(scope, f"~{variable}"))


def _one_step(first: Value, apply: Callable[[int, int], int], second: Value) -> Value:
    return lambda scope: apply(first(scope), second(scope))


def _steps(first: Value, steps: list[tuple[Callable[[int, int], int], Value]]) -> Value:
    def compute(scope: Scope) -> int:
        value = first(scope)
        for apply, term in steps:
            value = apply(value, term(scope))
        return value

    return compute


def _literal(text: str) -> int:
    if len(text) < 10 and text.isdecimal():
        return int(text) * ONE
    if "$" in text:
        return parse_fixed(text)
    # At most ten digits before the point can be in range; more would only cost time.
    if len(text.partition(".")[0].lstrip("-0")) > 10 or not fits(Fraction(f"{text}0" if text[-1] == "." else text)):
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return parse_fixed(text)


QUERY = "?"

_OPENING, _CLOSING = "([", ")]"


def split(text: str, separator: str = ",") -> list[str]:
    """Return the parts of `text` between separators outside brackets and quotes, stripped."""
    if '"' not in text and "(" not in text and "[" not in text:
        return [part.strip() for part in text.split(separator)]
    parts: list[str] = []
    depth, quoted, start = 0, False, 0
    for place, character in enumerate(text):
        if character == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif character in _OPENING:
            depth += 1
        elif character in _CLOSING:
            depth -= 1
        elif character == separator and depth <= 0:
            parts.append(text[start:place].strip())
            start = place + 1
    parts.append(text[start:].strip())
    return parts


def by_axis(text: str, letters: str) -> list[tuple[int, str]]:
    """Return (place in `letters`, argument) for the forms `1,,3`, `B=1`, `*=1`; an argument may be `?`.

    `letters` are the existing names, of axes or planes. Raises `Rejection` for an unknown name, for too many arguments,
    and for none.
    """
    text = text.strip()
    name, equals, value = text.partition("=")
    name = name.strip()
    if equals and (name == "*" or (len(name) == 1 and name.isupper())):
        value = value.strip()
        if not value:
            raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
        places = range(len(letters)) if name == "*" else [axis_place(name, letters)]
        return [(index, value) for index in places]
    given = [(index, part) for index, part in enumerate(split(text)) if part]
    if not given:
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    if given[-1][0] >= len(letters):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return given


def axis_place(letter: str, letters: str) -> int:
    """Return the place of a name; X, Y, Z, W are other names of A to D. Raises `Rejection` for an unknown name."""
    index = letters.find(letter.translate(ALIASES))
    if index < 0:
        raise Rejection(ErrorCode.S_OPERAND_INVALID if letter in "ST" else ErrorCode.INVALID_AXIS)
    return index


def mask(text: str, letters: str) -> list[int]:
    """Return the places of the names in `text`, all of them for an empty text and `*`; raises `Rejection` for others.

    Galil's command reference has `*` for all axes in `KP*=0`; that a mask accepts it is inferred: hosts send `ST*`.
    """
    names = text.replace(" ", "")
    if names in ("", "*"):
        return list(range(len(letters)))
    if not names.isalpha():
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return sorted({axis_place(name, letters) for name in names})


def axes_and_planes(text: str, letters: str) -> tuple[list[int], list[str]]:
    """Return the axes and the planes that a mask such as `ABS` names; both empty for an empty mask."""
    names = text.replace(" ", "")
    planes = sorted(set(names) & {"S", "T"})
    axes = "".join(name for name in names if name not in "ST")
    return (mask(axes, letters) if axes else []), planes
