"""A second interpreter of the controller's expressions, written from the manual; it shares nothing with the twin.

It counts in exact rationals and reads a text character by character; angles go through series of 50 decimals.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal, localcontext
from fractions import Fraction
from math import floor

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
"""The values of `~a`."""


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
    return folded(Fraction(floor(value + Fraction(1, 2))))


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


def second(text: str) -> tuple[Fraction | None, Reader]:
    """Return the value of the second interpreter, and the interpreter."""
    reader = Reader(text)
    try:
        return reader.all(), reader
    except No:
        return None, reader
