"""Expressions as a DMC evaluates them: strictly from left to right, in 32.16 fixed point (see `arithmetic`).

A text is compiled once and evaluated many times, as programs in loops do. What is misspelled is refused before
anything is looked up.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import Protocol, TypeAlias

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.numbers import fits, parse_fixed
from dmc41x3.twin.language.arithmetic import FUNCTIONS, ONE, OPERATORS, pack, whole, wrap
from dmc41x3.twin.refusal import Rejection

AXIS_NAMES = "ABCDEFGHSTNM"
"""What the values 0 to 11 of an axis variable `~a` stand for."""

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
"""What is wrong with a term that begins so; only quotes that are not closed come that far."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,7}")


class Scope(Protocol):
    """Where an expression looks up what it names; every value is raw fixed point."""

    def variable(self, name: str) -> int:
        """Return a variable, `~a` and `^a` among them; raises `Rejection` for one that was never assigned."""
        ...

    def element(self, name: str, index: int) -> int:
        """Return an element of an array, or its length for index -1; raises `Rejection` where there is none."""
        ...

    def operand(self, name: str) -> int:
        """Return an operand such as `TPA` (written `_TPA`), or a keyword; raises `Rejection` for an unknown one."""
        ...

    def bank(self, function: str, bit: int) -> int:
        """Return `@IN[bit]`, `@OUT[bit]` or `@AN[bit]`; raises `Rejection` for a bit that does not exist."""
        ...


Value: TypeAlias = Callable[[Scope], int]
"""An expression ready to be evaluated; raises `Rejection` for what cannot be looked up or computed."""


def evaluate(text: str, scope: Scope) -> int:
    """Return the raw value of an expression; raises `Rejection` with the code that fits what is wrong."""
    if len(text) < 10 and text.isascii() and (text.isdecimal() or (text[:1] == "-" and text[1:].isdecimal())):
        return int(text) * ONE
    return compiled(text)(scope)


@lru_cache(_CACHED)
def compiled(text: str) -> Value:
    """Return an expression to be evaluated; raises `Rejection` where it is misspelled."""
    if not text.strip():
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    parser = _Parser(text)
    value = parser.expression()
    parser.finish()
    return value


def is_name(text: str) -> bool:
    """Tell whether a text can name a variable or an array: a letter, then letters, digits, underscores, eight at most.

    Galil's command reference names letters and digits only; programs in use have underscores too (ISIS, galil_*.dmc).
    """
    return _NAME.fullmatch(text) is not None


def axis_letter(scope: Scope, variable: str) -> str:
    """Return the axis or plane that a variable `~a` stands for; raises `Rejection` where it was never assigned."""
    return AXIS_NAMES[whole(scope.variable(variable))]


class _Parser:
    """Reads one expression by recursive descent; there is one level of precedence."""

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
            # The sign belongs to a decimal, or -2147483648 could not be written.
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
        # A line has 80 characters, so this bound is never met on the wire; it keeps any text from the stack.
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
    # Ten digits before the point are the most that can be in range; more would only cost time.
    if len(text.partition(".")[0].lstrip("-0")) > 10 or not fits(Fraction(f"{text}0" if text[-1] == "." else text)):
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return parse_fixed(text)
