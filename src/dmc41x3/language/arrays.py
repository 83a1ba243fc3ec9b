"""Arrays on their way into a controller and back: QD and QU.

The array must be there already (DM); its name stands without brackets.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from dmc41x3.errors import InvalidValue, UnexpectedReply
from dmc41x3.language.numbers import SCALE, fits, fixed, parse_number

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,7}")
_SEPARATOR = re.compile(r"[,\r\n]+")
_LINE = 60
"""Characters after which a line of a download ends; a line of the controller holds 80."""

_PLACES = 10**5


def require_name(name: str) -> None:
    """Raise `InvalidValue` for what cannot be the name of an array."""
    if not _NAME.fullmatch(name):
        raise InvalidValue(key="array", value=repr(name), reason="a name is a letter and up to 7 letters or digits")


def require_fit(name: str, first: int, count: int, length: float) -> None:
    """Raise `InvalidValue` where `count` elements from `first` on do not fit into an array of `length`."""
    if first < 0 or first + count > length:
        reason = f"the array has the elements 0 to {length - 1:g}"
        raise InvalidValue(key=name, value=f"elements {first} to {first + count - 1}", reason=reason)


def length(name: str) -> str:
    """Return the operand that tells how many elements an array has."""
    require_name(name)
    return f"{name}[-1]"


def download(name: str, values: Sequence[float], first: int = 0) -> bytes:
    """Return the bytes that write `values` into an array, to be sent in one piece; a transfer answers them.

    Raises `InvalidValue` for a number that the controller's type cannot hold.
    """
    require_name(name)
    lines: list[str] = [""]
    for value in values:
        text = _literal(name, value)
        if len(lines[-1]) + len(text) >= _LINE:
            lines.append("")
        lines[-1] += f",{text}" if lines[-1] else text
    body = "\r".join(lines)
    return f"QD {name}[],{first},{first + len(values) - 1}\r{body}\r\\TC1\r".encode("ascii")


def upload(name: str, first: int | None = None, last: int | None = None) -> str:
    """Return the command that prints an array, or its elements `first` to `last`."""
    require_name(name)
    return f"QU {name}[]" if first is None or last is None else f"QU {name}[],{first},{last}"


def parse(command: str, text: str) -> list[float]:
    """Return the numbers that QU printed, whatever separates them; raises `UnexpectedReply` for anything else."""
    try:
        return [parse_number(word) for word in _SEPARATOR.split(text.strip()) if word.strip()]
    except ValueError as error:
        raise UnexpectedReply(command=command, reply=text[:40]) from error


def _literal(name: str, value: float) -> str:
    """Return the shortest decimal that the controller, which truncates, reads as this number.

    Five decimals, rounded away from zero, are nearer to it than a step of 1/65536; the four that it prints are not.
    """
    if not fits(value):
        raise InvalidValue(key=name, value=f"{value:g}", reason="an element lies between -2^31 and 2^31")
    raw = fixed(value)
    whole, rest = divmod(-(-abs(raw) * _PLACES // SCALE), _PLACES)
    sign = "-" if raw < 0 else ""
    return f"{sign}{whole}.{rest:05d}" if rest else f"{sign}{whole}"
