"""The twin's arithmetic against a second interpreter, written from what the manual says and sharing nothing with it.

The second one counts in exact rationals and reads the text character by character; angles go through series of
50 decimals. Both must come to the same number, or both refuse.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal, localcontext
from fractions import Fraction
from math import ceil, floor
from random import Random

import pytest

from maya_un.virtual.expressions import evaluate
from maya_un.virtual.operands import Names
from maya_un.virtual.refusal import Refused
from tests.campaign import Campaign
from tests.unit.virtual.bench import Bench

STEP = Fraction(1, 65536)
LARGEST = Fraction(2**31) - STEP
SMALLEST = Fraction(-(2**31))

VARIABLES = {
    "v": Fraction(7),
    "half": Fraction(-1, 2),
    "big": LARGEST,
    "low": SMALLEST,
    "tiny": STEP,
    "X1": Fraction(360),
    "s": Fraction(0x616263) * 2**24 / 65536,
}
ARRAY = [Fraction(3), Fraction(-5, 4), Fraction(100000), STEP]
OUTPUTS = {2, 5}
VOLTS = {1: Fraction(5, 2), 3: Fraction(-10)}
AXIS_VARIABLE = 2
"""What `~a` stands for."""


class No(Exception):
    """The expression is refused."""


class Reader:
    """Reads and computes one expression.

    `exact` is false once a series or a root went in, `foreign` true where it names an operand that is not defined here.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.exact = True
        self.foreign = False

    def all(self) -> Fraction:
        value = self.chain()
        if self.peek():
            raise No
        return value

    def peek(self) -> str:
        """Return the next character that is no blank, empty at the end."""
        while self.at < len(self.text) and self.text[self.at] == " ":
            self.at += 1
        return self.text[self.at : self.at + 1]

    def take(self, wanted: str) -> None:
        if self.peek() != wanted or not wanted:
            raise No
        self.at += 1

    def run(self, allowed: Callable[[str], bool]) -> str:
        """Return the characters from here on that are allowed."""
        start = self.at
        while self.at < len(self.text) and allowed(self.text[self.at]):
            self.at += 1
        return self.text[start : self.at]

    def chain(self) -> Fraction:
        left = self.operand()
        while (sign := self.operator()) is not None:
            left = computed(sign, left, self.operand())
        return left

    def operator(self) -> str | None:
        first = self.peek()
        if not first or first not in "+-*/%&|=<>":
            return None
        two = self.text[self.at : self.at + 2]
        sign = two if two in ("<=", ">=", "<>") else first
        self.at += len(sign)
        return sign

    def operand(self) -> Fraction:
        first = self.peek()
        if first == "-":
            self.at += 1
            if self.peek().isdigit() or self.peek() == ".":
                return self.decimal(-1)
            return folded(-self.operand())
        if first.isdigit() or first == ".":
            return self.decimal(1)
        if first == "(":
            self.at += 1
            value = self.chain()
            self.take(")")
            return value
        readers = {"$": self.hexadecimal, '"': self.string, "@": self.function, "_": self.internal}
        if first in readers:
            self.at += 1
            return readers[first]()
        return self.name()

    def decimal(self, sign: int) -> Fraction:
        whole = self.run(str.isdigit)
        fraction = ""
        if self.text[self.at : self.at + 1] == ".":
            self.at += 1
            fraction = self.run(str.isdigit)
        if not whole + fraction:
            raise No
        value = sign * Fraction(int(whole + fraction), 10 ** len(fraction))
        if not SMALLEST <= value < 2**31:
            raise No
        return cut(value)

    def hexadecimal(self) -> Fraction:
        whole = self.run(is_hex)
        fraction = ""
        if self.text[self.at : self.at + 1] == ".":
            self.at += 1
            fraction = self.run(is_hex)
            if not fraction:
                raise No
        if not 1 <= len(whole) <= 8 or len(fraction) > 4:
            raise No
        return folded(Fraction(int(whole + fraction, 16), 16 ** len(fraction)))

    def string(self) -> Fraction:
        body = self.run(lambda character: character != '"')
        self.take('"')
        if len(body) > 6:
            raise No
        codes = [ord(character) for character in body] + [0] * (6 - len(body))
        return from_bits(sum(code * 256**place for place, code in enumerate(reversed(codes))))

    def internal(self) -> Fraction:
        name = self.run(lambda character: "A" <= character <= "Z" or character.isdigit())
        if self.text[self.at : self.at + 2] == "~a" and name == "SP":
            self.at += 2
            name += "ABC"[AXIS_VARIABLE]
        if name not in ("SPA", "SPC", "BV"):
            self.foreign = True
            raise No
        return Fraction({"SPA": 25000, "SPC": 1000, "BV": 3}[name])

    def name(self) -> Fraction:
        first = self.text[self.at : self.at + 1]
        if first == "~":
            self.at += 1
            if self.run(str.isalnum) != "a":
                raise No
            return Fraction(AXIS_VARIABLE)
        if not first.isalpha():
            raise No
        name = self.run(str.isalnum)
        if self.text[self.at : self.at + 1] == "[":
            self.at += 1
            index = int(self.chain())
            self.take("]")
            return element(name, index)
        if name not in VARIABLES:
            raise No
        return VARIABLES[name]

    def function(self) -> Fraction:
        name = self.run(lambda character: "A" <= character <= "Z")
        self.take("[")
        value = self.chain()
        self.take("]")
        if name in SERIES:
            self.exact = False
            return SERIES[name](value)
        if name not in EXACT:
            raise No
        return EXACT[name](value)


def is_hex(character: str) -> bool:
    return character in "0123456789abcdefABCDEF"


def cut(value: Fraction) -> Fraction:
    """Drop what is finer than a step, towards zero."""
    return int(value / STEP) * STEP


def folded(value: Fraction) -> Fraction:
    """Bring a value back into the range by whole spans of it."""
    return (value - SMALLEST) % 2**32 + SMALLEST


def bits(value: Fraction) -> int:
    return int(value / STEP) % 2**48


def from_bits(pattern: int) -> Fraction:
    return folded(pattern * STEP)


def element(name: str, index: int) -> Fraction:
    if name != "arr" or not -1 <= index < len(ARRAY):
        raise No
    return Fraction(len(ARRAY)) if index == -1 else ARRAY[index]


def computed(sign: str, a: Fraction, b: Fraction) -> Fraction:
    if sign in "/%":
        if not b:
            raise No
        return folded(cut(a / b)) if sign == "/" else a - b * int(a / b)
    if sign in "&|":
        return from_bits(bits(a) & bits(b) if sign == "&" else bits(a) | bits(b))
    if sign in "+-*":
        return folded({"+": a + b, "-": a - b, "*": cut(a * b)}[sign])
    outcome = {"=": a == b, "<>": a != b, "<": a < b, ">": a > b, "<=": a <= b, ">=": a >= b}[sign]
    return Fraction(int(outcome))


def nearest(value: Fraction) -> Fraction:
    return folded(Fraction(floor(value + Fraction(1, 2)) if value >= 0 else ceil(value - Fraction(1, 2))))


def single(value: Fraction) -> Fraction:
    """The bits of an IEEE single: sign, exponent with a bias of 127, 23 of the 24 bits of the mantissa."""
    if not value:
        return Fraction(0)
    size, exponent = abs(value), 0
    while size >= 2:
        size, exponent = size / 2, exponent + 1
    while size < 1:
        size, exponent = size * 2, exponent - 1
    mantissa = round(size * 2**23)  # Python rounds halves to even, as IEEE does
    pattern = (exponent + 127 << 23) + mantissa - 2**23 + (2**31 if value < 0 else 0)
    return folded(Fraction(pattern))


def from_single(value: Fraction) -> Fraction:
    pattern = floor(value) % 2**32
    exponent, mantissa = pattern >> 23 & 255, pattern & 2**23 - 1
    if exponent == 255:
        raise No
    size = Fraction(mantissa + (2**23 if exponent else 0)) * Fraction(2) ** (max(exponent, 1) - 150)
    number = -size if pattern >> 31 else size
    if not SMALLEST <= number < 2**31:
        raise No
    return cut(number)


def input_level(value: Fraction) -> Fraction:
    if 1 <= int(value) <= 8 or 81 <= int(value) <= 86:
        return Fraction(1)
    raise No


def output_level(value: Fraction) -> Fraction:
    if 1 <= int(value) <= 8:
        return Fraction(int(int(value) in OUTPUTS))
    raise No


def volts(value: Fraction) -> Fraction:
    if 1 <= int(value) <= 8:
        return VOLTS.get(int(value), Fraction(0))
    raise No


EXACT: dict[str, Callable[[Fraction], Fraction]] = {
    "ABS": lambda value: folded(abs(value)),
    "INT": lambda value: Fraction(int(value)),
    "FRAC": lambda value: value - int(value),
    "RND": nearest,
    "COM": lambda value: Fraction(-floor(value) - 1),
    "FLOT": single,
    "REAL": from_single,
    "IN": input_level,
    "OUT": output_level,
    "AN": volts,
}

PI = Decimal("3.14159265358979323846264338327950288419716939937510")
RADIAN = PI / 180


def decimal(value: Fraction) -> Decimal:
    return Decimal(value.numerator) / Decimal(value.denominator)


def sine(degrees: Fraction) -> Decimal:
    x = decimal(degrees % 360) * RADIAN
    term = total = x
    n = 1
    while abs(term) > Decimal("1e-40"):
        term *= -x * x / ((n + 1) * (n + 2))
        total += term
        n += 2
    return total


def arc_tangent(x: Decimal) -> Decimal:
    """In degrees; the angle is halved until the series runs fast."""
    doublings = 4
    for _ in range(doublings):
        x = x / (1 + (1 + x * x).sqrt())
    power = total = x
    n = 1
    while abs(power) > Decimal("1e-40"):
        power *= -x * x
        n += 2
        total += power / n
    return total * 2**doublings / RADIAN


def arc_sine(value: Fraction) -> Decimal:
    if abs(value) > 1:
        raise No
    if abs(value) == 1:
        return Decimal(90) * int(value)
    x = decimal(value)
    return arc_tangent(x / (1 - x * x).sqrt())


def tangent(value: Fraction) -> Decimal:
    if value % 180 == 90:
        raise No
    return sine(value) / sine(value + 90)


def series(function: Callable[[Fraction], Decimal]) -> Callable[[Fraction], Fraction]:
    def apply(value: Fraction) -> Fraction:
        with localcontext() as context:
            context.prec = 50
            return round(Fraction(function(value)) / STEP) * STEP

    return apply


SERIES: dict[str, Callable[[Fraction], Fraction]] = {
    "SIN": series(sine),
    "COS": series(lambda value: sine(value + 90)),
    "TAN": series(tangent),
    "ASIN": series(arc_sine),
    "ACOS": series(lambda value: 90 - arc_sine(value)),
    "ATAN": series(lambda value: arc_tangent(decimal(value))),
    "SQR": series(lambda value: decimal(abs(value)).sqrt()),
}


class Writer:
    """Makes up expressions."""

    def __init__(self, rng: Random) -> None:
        self.rng = rng

    def expression(self, depth: int) -> str:
        parts = [self.term(depth)]
        for _ in range(self.rng.choice((0, 1, 1, 1, 2, 3))):
            parts += [self.rng.choice("+-*/%&|=<>") + self.rng.choice(("", "", "", "=", ">")), self.term(depth)]
            # Not every pair of characters is an operator; the misspelled ones are for the refusals.
            if parts[-2] not in ("<=", ">=", "<>"):
                parts[-2] = parts[-2][0]
        return self.rng.choice(("", "", "", " ")).join(parts)

    def term(self, depth: int) -> str:
        if depth <= 0 or self.rng.random() < 0.4:
            return self.leaf()
        inner = self.expression(depth - 1)
        kind = self.rng.randrange(8)
        if kind < 3:
            return f"({inner})"
        if kind == 3:
            return f"-{self.term(depth - 1)}"
        if kind == 4:
            return f"arr[{self.rng.choice((inner, '0', '3', '-1', '1.9', '4'))}]"
        if kind == 5:
            return f"@{self.rng.choice(('IN', 'OUT', 'AN'))}[{self.rng.choice((inner, '1', '2', '8', '81', '9'))}]"
        return f"@{self.rng.choice(('ABS', 'INT', 'FRAC', 'RND', 'COM', 'FLOT', 'REAL'))}[{inner}]"

    def leaf(self) -> str:
        rng = self.rng
        small = (0, 1, 2, 3, 7, 10, 90, 1000)
        kinds: list[Callable[[], str]] = [
            lambda: str(rng.choice(small)),
            lambda: str(rng.choice((*small, rng.randrange(2**31), rng.randrange(3 * 10**9)))),
            lambda: f"{rng.choice(('', '0', rng.randrange(1000), rng.randrange(2**31)))}.{rng.randrange(10**6)}",
            lambda: f"-{rng.choice((rng.randrange(2**31), 2**31))}",
            lambda: f"${rng.randrange(16 ** rng.randrange(1, 9)):X}{rng.choice(('', f'.{rng.randrange(65536):04X}'))}",
            lambda: f'"{"".join(rng.choices("abcXY Z(1", k=rng.randrange(1, 7)))}"',
            lambda: rng.choice(("_SPA", "_SP~a", "_BV", "~a")),
            lambda: rng.choice(tuple(VARIABLES)),
            lambda: rng.choice(tuple(VARIABLES)),
        ]
        return rng.choice(kinds)()

    def spoiled(self, text: str) -> str:
        """Change, drop or insert a character or two."""
        for _ in range(self.rng.choice((1, 1, 2))):
            place = self.rng.randrange(len(text) + 1)
            new = self.rng.choice(("", *'0123456789ABFabv+-*/%&|=<>()[]"@_$.~^?,{ #!'))
            text = text[:place] + new + text[place + self.rng.randrange(2) :]
        return text


@pytest.fixture(scope="module")
def names() -> Names:
    """A controller on which the same things are defined."""
    bench = Bench()
    bench.do("DM arr[4]", "SPC=1000", f"~a={AXIS_VARIABLE}", *(f"SB {bit}" for bit in OUTPUTS))
    unit = bench.machine.unit
    unit.variables.update({name: int(value * 65536) for name, value in VARIABLES.items()})
    unit.arrays.row("arr")[:] = [int(value * 65536) for value in ARRAY]
    for number, value in VOLTS.items():
        unit.analog[number - 1] = float(value)
    return Names(unit)


def twin(text: str, names: Names) -> Fraction | None:
    try:
        return Fraction(evaluate(text, names), 65536)
    except Refused:
        return None


def second(text: str) -> tuple[Fraction | None, Reader]:
    """Return what the second interpreter says, and the interpreter."""
    reader = Reader(text)
    try:
        return reader.all(), reader
    except No:
        return None, reader


def test_both_interpreters_come_to_the_same_number(campaign: Campaign, names: Names) -> None:
    writer = Writer(campaign.rng())
    refused = 0
    size = campaign.size(ci=5_000, long=100_000)
    for _ in range(size):
        text = writer.expression(3)
        expected, _ = second(text)
        refused += expected is None
        assert twin(text, names) == expected, text
    assert 0.1 < refused / size < 0.6


def test_both_interpreters_refuse_the_same_texts(campaign: Campaign, names: Names) -> None:
    writer = Writer(campaign.rng())
    accepted = 0
    size = campaign.size(ci=5_000, long=100_000)
    for _ in range(size):
        text = writer.spoiled(writer.expression(1))
        expected, reader = second(text)
        accepted += expected is not None
        got = twin(text, names)
        if not reader.foreign:
            assert (got == expected) if reader.exact else (got is None) == (expected is None), text
    assert 0.1 < accepted / size < 0.9


def test_both_interpreters_agree_on_angles_and_roots(campaign: Campaign, names: Names) -> None:
    rng = campaign.rng()
    writer = Writer(rng)
    for _ in range(campaign.size(ci=2_000, long=40_000)):
        inner = rng.choice(
            (
                writer.expression(1),
                f"{rng.uniform(-1.1, 1.1):.6f}",
                f"{rng.uniform(-800, 800):.5f}",
                f"{rng.choice((-270, -90, 90, 270, 450))}+(tiny*{rng.randrange(-3, 4)})",
                str(30 * rng.randrange(-30, 30)),
            )
        )
        text = f"@{rng.choice(tuple(SERIES))}[{inner}]"
        expected, _ = second(text)
        got = twin(text, names)
        assert (got is None) == (expected is None), text
        assert got is None or expected is None or abs(got - expected) <= STEP, text


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("@SIN[30]", Fraction(1, 2)),
        ("@TAN[45]", Fraction(1)),
        ("@ACOS[-1]", Fraction(180)),
        ("@ATAN[1]", Fraction(45)),
        ("@SQR[-2]", Fraction(92682, 65536)),
        ("1+2*3", Fraction(9)),
        ("-7%3", Fraction(-1)),
        ("2147483647+1", Fraction(-(2**31))),
        ("@FLOT[-1.5]", Fraction(-1077936128)),
        ("@REAL[$3FC00000]", Fraction(3, 2)),
        ('"A"', Fraction(0x41 * 2**24)),
    ],
)
def test_the_second_interpreter_itself(text: str, value: Fraction) -> None:
    assert second(text)[0] == value
