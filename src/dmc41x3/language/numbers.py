"""The controller's only number type, signed fixed point of 32 integer and 16 fraction bits, and its print formats.

`raw` below means the number times 65536 as an integer. Printed numbers begin with a slot for the sign: a blank
or a minus. They are rounded to the places printed, as the controller's own constants show (9.9982 is stored as
655242 / 65536 = 9.99820).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from fractions import Fraction

SCALE = 1 << 16
RAW_MAX = (1 << 47) - 1
RAW_MIN = -(1 << 47)

_DECIMAL = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_HEX = re.compile(r"([-+]?)\$([0-9A-Fa-f]{1,8})(?:\.([0-9A-Fa-f]{1,4}))?")


def fits(value: float | Fraction) -> bool:
    """Return whether a number lies in the range of the type, -2^31 to 2^31 - 1/65536."""
    return RAW_MIN <= value * SCALE < RAW_MAX + 1


def fixed(value: float | Fraction) -> int:
    """Return `value` as raw fixed point: truncated towards zero, saturated at the ends of the range.

    Raises `ValueError` for NaN.
    """
    if fits(value):
        return int(value * SCALE)
    if value != value:  # noqa: PLR0124 - the definition of NaN
        raise ValueError("NaN has no fixed-point form")
    return RAW_MAX if value > 0 else RAW_MIN


def parse_fixed(text: str) -> int:
    """Return the raw fixed point of a literal, decimal (`-12.5`) or hexadecimal (`$7FFFFFFF.FFFF`).

    Hexadecimal digits are the two's complement of the stored number. Decimals are truncated and saturated.
    Raises `ValueError` for anything else, exponents included.
    """
    text = text.strip()
    if _DECIMAL.fullmatch(text):
        return fixed(Fraction(text if text[-1] != "." else text + "0"))
    found = _HEX.fullmatch(text)
    if found is None:
        raise ValueError(f"not a number: {text!r}")
    sign, whole, fraction = found.groups()
    raw = int(whole, 16) << 16 | int((fraction or "").ljust(4, "0"), 16)
    signed = raw - (1 << 48) if raw > RAW_MAX else raw
    return min(-signed, RAW_MAX) if sign == "-" else signed


def parse_number(text: str) -> float:
    """Return the value of one printed number or literal; raises `ValueError` for anything else."""
    text = text.strip()
    return float(text) if _DECIMAL.fullmatch(text) else parse_fixed(text) / SCALE


def format_value(
    x: float | Fraction,
    before: int = 10,
    after: int = 4,
    leading_zeros: bool = False,
    hex: bool = False,
) -> str:
    """Return a number as VF and MG print it: `before` digits, a point, `after` digits; ` 1.0000`, `-12.5000`.

    A number too large for its digits prints as the largest they can show. Hexadecimal shows the two's
    complement after a `$`, always with all its digits, and has no slot for the sign.
    """
    return format_raw(fixed(x), before, after, leading_zeros, hex)


def format_raw(raw: int, before: int = 10, after: int = 4, leading_zeros: bool = False, hex: bool = False) -> str:
    """Return a raw fixed-point number as `format_value` prints it."""
    return _hexadecimal(raw, before, after) if hex else _decimal(raw, before, after, leading_zeros)


def join_positions(printed: Iterable[str]) -> str:
    """Return the reply of a command that answers for several axes: ` 200, -10, 0`."""
    first, *others = printed
    return ", ".join([first, *(number.lstrip(" ") for number in others)])


def _decimal(raw: int, before: int, after: int, leading_zeros: bool) -> str:
    power = 10**after
    digits = (abs(raw) * power * 2 + SCALE) // (2 * SCALE)
    largest = min(10 ** (before + after), (1 << 31) * power + (raw < 0)) - 1
    digits = min(digits, largest)
    sign = "-" if raw < 0 and digits else " "
    whole = str(digits // power)
    whole = whole.zfill(before) if leading_zeros else whole
    if before == 0:
        whole = ""
    return f"{sign}{whole}.{digits % power:0{after}d}" if after else f"{sign}{whole}"


def _hexadecimal(raw: int, before: int, after: int) -> str:
    bits = 4 * before
    top = 1 << (16 + bits)
    if raw >= top:
        raw = top - 1
    whole, fraction = divmod(raw & ((1 << 48) - 1) & (top - 1), SCALE)
    text = f"${whole:0{before}X}"
    return f"{text}.{fraction >> (16 - 4 * after):0{after}X}" if after else text
