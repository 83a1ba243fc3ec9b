"""Expressions as a DMC evaluates them: 32.16 fixed point, strictly from left to right.

Values are raw fixed point: the number times 65536, as an integer of 48 bits. Products and quotients are truncated
towards zero; a result beyond the range wraps as the registers do. Which of these a real box does on overflow is
not documented; nothing above relies on it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Protocol

from maya_un.galil.codes import ErrorCode
from maya_un.galil.numbers import SCALE, fits, parse_fixed
from maya_un.virtual.refusal import Refused

ONE = SCALE
STRING_LENGTH = 6
"""A string lives in the six bytes of a number."""

_SPAN = 1 << 48
_HALF = 1 << 47

_NUMBER = re.compile(r"\s*([0-9]+\.?[0-9]*|\.[0-9]+|\$[0-9A-Fa-f]{1,8}(?:\.[0-9A-Fa-f]{1,4})?)")
_WORD = re.compile(r"\s*(@[A-Z]+|_[A-Z0-9]+|[A-Za-z][A-Za-z0-9]*)")
_STRING = re.compile(r'\s*"([^"]*)"')
_OPERATOR = re.compile(r"\s*(<=|>=|<>|[-+*/%&|=<>])")
_SYMBOL = re.compile(r"\s*([-(\[\])])")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]{0,7}")


class Scope(Protocol):
    """Where an expression looks up what it names; every value is raw fixed point."""

    def variable(self, name: str) -> int:
        """Return a variable; raises `Refused` for one that was never assigned."""
        ...

    def operand(self, name: str) -> int:
        """Return an operand such as `TPA` (written `_TPA`), or TIME; raises `Refused` for an unknown one."""
        ...

    def bank(self, function: str, bit: int) -> int:
        """Return `@IN[bit]`, `@OUT[bit]` or `@AN[bit]`; raises `Refused` for a bit that does not exist."""
        ...


def evaluate(text: str, scope: Scope) -> int:
    """Return the raw value of an expression; raises `Refused` with the code that fits what is wrong."""
    stripped = text.strip()
    digits = stripped.removeprefix("-")
    if digits.isdecimal() and digits.isascii() and len(digits) < 10:
        return int(stripped) * ONE
    parser = _Parser(stripped, scope)
    value = parser.expression()
    parser.finish()
    return value


def is_name(text: str) -> bool:
    """Tell whether a text can name a variable: a letter, then letters and digits, eight at most."""
    return _NAME.fullmatch(text) is not None


def pack(text: str) -> int:
    """Return a string of up to six characters as a raw value; raises `Refused` for a longer one."""
    if len(text) > STRING_LENGTH or not text.isascii():
        raise Refused(ErrorCode.BAD_STRING)
    return wrap(int.from_bytes(text.encode("ascii").ljust(STRING_LENGTH, b"\0"), "big"))


def unpack(raw: int, length: int = STRING_LENGTH) -> str:
    """Return the first `length` characters that a raw value holds as a string; unprintable bytes are left out."""
    data = (raw % _SPAN).to_bytes(STRING_LENGTH, "big")[:length]
    return "".join(chr(byte) for byte in data if 0x20 <= byte < 0x7F)


def wrap(raw: int) -> int:
    """Return a raw value folded into 48 bits."""
    return (raw + _HALF) % _SPAN - _HALF


class _Parser:
    """Reads one expression by recursive descent; there is one level of precedence."""

    def __init__(self, text: str, scope: Scope) -> None:
        self._text = text
        self._at = 0
        self._scope = scope
        self._depth = 0

    def expression(self) -> int:
        value = self._term()
        while (operator := self._match(_OPERATOR)) is not None:
            value = wrap(_OPERATORS[operator](value, self._term()))
        return value

    def finish(self) -> None:
        rest = self._text[self._at :].strip()
        if rest:
            raise Refused(ErrorCode.PARENTHESES if rest[0] in "()" else ErrorCode.OPERAND_ERROR)

    def _match(self, pattern: re.Pattern[str]) -> str | None:
        found = pattern.match(self._text, self._at)
        if found is None:
            return None
        self._at = found.end()
        return found[1]

    def _term(self) -> int:
        number = self._match(_NUMBER)
        if number is not None:
            return _literal(number)
        word = self._match(_WORD)
        if word is not None:
            return self._named(word)
        string = self._match(_STRING)
        if string is not None:
            return pack(string)
        symbol = self._match(_SYMBOL)
        if symbol == "-":
            return self._negative()
        if symbol == "(":
            return self._enclosed(")", ErrorCode.PARENTHESES)
        raise Refused(ErrorCode.OPERAND_ERROR)

    def _negative(self) -> int:
        # The sign belongs to a literal, or -2147483648 could not be written.
        number = self._match(_NUMBER)
        return wrap(-self._nested(self._term)) if number is None else _literal(f"-{number}")

    def _named(self, word: str) -> int:
        if word[0] == "@":
            return self._function(word[1:])
        if word[0] == "_":
            return self._scope.operand(word[1:])
        if self._text.startswith("[", self._at):
            raise Refused(ErrorCode.BAD_FUNCTION)
        return self._scope.operand(word) if word == "TIME" else self._scope.variable(word)

    def _function(self, name: str) -> int:
        if self._match(_SYMBOL) != "[":
            raise Refused(ErrorCode.MISSING_BRACKET)
        value = self._enclosed("]", ErrorCode.MISSING_BRACKET)
        if name in ("IN", "OUT", "AN"):
            return self._scope.bank(name, value // ONE)
        try:
            return wrap(_FUNCTIONS[name](value))
        except KeyError:
            raise Refused(ErrorCode.BAD_FUNCTION) from None

    def _enclosed(self, end: str, missing: ErrorCode) -> int:
        value = self._nested(self.expression)
        if self._match(_SYMBOL) != end:
            raise Refused(missing)
        return value

    def _nested(self, read: Callable[[], int]) -> int:
        # A line has 80 characters, so this bound is never met on the wire; it keeps any text from the stack.
        self._depth += 1
        if self._depth > 100:
            raise Refused(ErrorCode.PARENTHESES)
        value = read()
        self._depth -= 1
        return value


def _literal(text: str) -> int:
    # Ten digits before the point are the most that can be in range; more would only cost time.
    if "$" in text:
        return parse_fixed(text)
    if len(text.partition(".")[0].lstrip("-0")) > 10 or not fits(float(text)):
        raise Refused(ErrorCode.OUT_OF_RANGE)
    return parse_fixed(text)


def _quotient(a: int, b: int) -> int:
    if b == 0:
        raise Refused(ErrorCode.OUT_OF_RANGE)
    size = (abs(a) << 16) // abs(b)
    return size if (a < 0) == (b < 0) else -size


def _product(a: int, b: int) -> int:
    size = abs(a) * abs(b) >> 16
    return size if (a < 0) == (b < 0) else -size


def _modulo(a: int, b: int) -> int:
    if b == 0:
        raise Refused(ErrorCode.OUT_OF_RANGE)
    return int(math.copysign(abs(a) % abs(b), a))


def _whole(a: int) -> int:
    return a // ONE * ONE if a >= 0 else -(-a // ONE * ONE)


def _rounded(a: int) -> int:
    half_up = (abs(a) + ONE // 2) // ONE * ONE
    return half_up if a >= 0 else -half_up


def _real(function: Callable[[float], float]) -> Callable[[int], int]:
    """Return a function of floats as one of raw values; outside its domain or range it is refused with code 6."""

    def apply(a: int) -> int:
        try:
            result = function(a / ONE)
        except ValueError:
            raise Refused(ErrorCode.OUT_OF_RANGE) from None
        if not fits(result):
            raise Refused(ErrorCode.OUT_OF_RANGE)
        return round(result * ONE)

    return apply


_OPERATORS: dict[str, Callable[[int, int], int]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": _product,
    "/": _quotient,
    "%": _modulo,
    "&": lambda a, b: a & b,
    "|": lambda a, b: a | b,
    "=": lambda a, b: ONE * (a == b),
    "<>": lambda a, b: ONE * (a != b),
    "<": lambda a, b: ONE * (a < b),
    ">": lambda a, b: ONE * (a > b),
    "<=": lambda a, b: ONE * (a <= b),
    ">=": lambda a, b: ONE * (a >= b),
}

_FUNCTIONS: dict[str, Callable[[int], int]] = {
    "SIN": _real(lambda x: math.sin(math.radians(x))),
    "COS": _real(lambda x: math.cos(math.radians(x))),
    "TAN": _real(lambda x: math.tan(math.radians(x))),
    "ASIN": _real(lambda x: math.degrees(math.asin(x))),
    "ACOS": _real(lambda x: math.degrees(math.acos(x))),
    "ATAN": _real(lambda x: math.degrees(math.atan(x))),
    "SQR": _real(lambda x: math.sqrt(abs(x))),
    "ABS": abs,
    "INT": _whole,
    "FRAC": lambda a: a - _whole(a),
    "RND": _rounded,
    "COM": lambda a: ~(a // ONE) * ONE,
}
