"""What a DMC computes with: operators and functions on 32.16 fixed point.

A raw value is the number times 65536, as an integer of 48 bits. Products and quotients are truncated towards zero; a
result beyond the range wraps as the registers do. What a function has no answer for is refused with code 6: division
by zero, an angle whose tangent is too large. Which of these a real box does is not documented; nothing above relies
on it.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.numbers import RAW_MAX, RAW_MIN, SCALE, fits
from dmc41x3.twin.refusal import Rejection

ONE = SCALE
STRING_LENGTH = 6
"""A string lives in the six bytes of a number."""

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
    """Return the first `length` characters that a raw value holds as a string; unprintable bytes are left out."""
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
"""Operators on raw values in range, giving raw values in range. `&` and `|` take all 48 bits."""


def _rounded(a: int) -> int:
    """Return the nearest whole number, halves upwards: 5.5 gives 6, -5.5 gives -5 (Galil's command reference, @RND)."""
    return wrap((a + ONE // 2) // ONE * ONE)


def _real(function: Callable[[float], float]) -> Callable[[int], int]:
    """Return a function of floats as one of raw values, rounded; outside its domain or range it is refused."""

    def apply(a: int) -> int:
        try:
            result = function(a / ONE)
        except ValueError:
            raise Rejection(ErrorCode.OUT_OF_RANGE) from None
        return round(result * ONE)

    return apply


def _sine(a: int) -> int:
    # Whole turns are taken off while the angle is exact.
    return round(math.sin(math.radians(a % _TURN / ONE)) * ONE)


def _cosine(a: int) -> int:
    return round(math.cos(math.radians(a % _TURN / ONE)) * ONE)


def _tangent(a: int) -> int:
    """Return the tangent; beyond 45 degrees by that of the complement, which is exact where the tangent is large."""
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
    """Return the number, without what is below 1/65536, of an IEEE single given by its bits (@REAL)."""
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
