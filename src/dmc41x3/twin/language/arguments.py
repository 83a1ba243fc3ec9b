"""Arguments of commands: which axis each belongs to, still as text to be evaluated."""

from __future__ import annotations

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.hardware import ALIASES
from dmc41x3.twin.refusal import Rejection

QUERY = "?"

_OPENING, _CLOSING = "([", ")]"


def split(text: str, separator: str = ",") -> list[str]:
    """Return the parts of `text` between separators that stand outside brackets and quotes, stripped."""
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

    `letters` are the names there are, axes or planes. Raises `Rejection` for a name or place too many, and where
    there is no argument at all.
    """
    text = text.strip()
    name, equals, value = text.partition("=")
    name = name.strip()
    if equals and (name == "*" or (len(name) == 1 and name.isupper())):
        value = value.strip()
        if not value:
            raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
        places = range(len(letters)) if name == "*" else [place(name, letters)]
        return [(index, value) for index in places]
    given = [(index, part) for index, part in enumerate(split(text)) if part]
    if not given:
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    if given[-1][0] >= len(letters):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return given


def place(letter: str, letters: str) -> int:
    """Return the place of a name; X, Y, Z, W are other names of A to D. Raises `Rejection` where it has none."""
    index = letters.find(letter.translate(ALIASES))
    if index < 0:
        raise Rejection(ErrorCode.S_OPERAND_INVALID if letter in "ST" else ErrorCode.INVALID_AXIS)
    return index


def mask(text: str, letters: str) -> list[int]:
    """Return the places of the names in `text`, all of them for an empty one and `*`; raises `Rejection` for others.

    Galil's command reference has `*` for all axes in `KP*=0`; that a mask takes it is inferred: hosts send `ST*`.
    """
    names = text.replace(" ", "")
    if names in ("", "*"):
        return list(range(len(letters)))
    if not names.isalpha():
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return sorted({place(name, letters) for name in names})


def axes_and_planes(text: str, letters: str) -> tuple[list[int], list[str]]:
    """Return the axes and the planes that a mask such as `ABS` names; both empty for an empty mask."""
    names = text.replace(" ", "")
    planes = sorted(set(names) & {"S", "T"})
    axes = "".join(name for name in names if name not in "ST")
    return (mask(axes, letters) if axes else []), planes
