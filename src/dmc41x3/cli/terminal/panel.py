"""The picture of the axes below the line: styled pieces of text, made from a record."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import TypeAlias

from dmc41x3.language.codes import STOP_TEXTS
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import AxisRecord, AxisSwitches, DataRecord

Piece: TypeAlias = tuple[str, str]
"""A style and a text."""

Line: TypeAlias = list[Piece]

HEAD = "     position velocity  error  torque motor  motion  lim stop code"
"""Names of the columns; `lim` is F, R and H for the forward, reverse and home switch where they are active."""


def axes(record: DataRecord, width: int) -> list[Line]:
    """Return a head and one line an axis: counts, counts/s, counts, V, motor, motion, switches, stop code."""
    rows = zip(LETTERS, record.axes, strict=False)
    return [[("class:head", HEAD[:width])], *(_axis(letter, axis, width) for letter, axis in rows)]


def _axis(letter: str, axis: AxisRecord, width: int) -> Line:
    line: Line = [
        ("class:letter", letter),
        ("", f" {axis.position:>11} {axis.velocity:>8.0f} {axis.error:>6} {axis.torque:>6.2f}V"),
        ("class:off", "   off") if axis.motor_off else ("", "    on"),
        ("class:moving", "  moving ") if axis.moving else ("", "  at rest"),
        ("", " "),
        _switch("F", axis.forward_limit_active, "class:active"),
        _switch("R", axis.reverse_limit_active, "class:active"),
        _switch("H", bool(axis.switches & AxisSwitches.HOME_INPUT), "class:letter"),
    ]
    left = width - sum(len(text) for _, text in line)
    words = f" {axis.stop_code:>3} {STOP_TEXTS.get(axis.stop_code, '')}"
    return [*line, ("", words if len(words) <= left else words[: left - 1] + "…")]


def _switch(letter: str, active: bool, style: str) -> Piece:
    return (style, letter) if active else ("class:quiet", "·")


def watched(values: Mapping[str, str], width: int) -> list[Line]:
    """Return the watched expressions with their values, as many on a line as fit."""
    lines: list[Line] = []
    used = width
    for expression, value in values.items():
        refused = value.startswith("?")
        pieces: Line = [("class:letter", f"{expression} "), ("class:refused" if refused else "", value)]
        length = sum(len(text) for _, text in pieces)
        if used + 3 + length > width:
            lines.append([])
            used = 0
        elif used:
            lines[-1].append(("", "   "))
            used += 3
        lines[-1] += pieces
        used += length
    return lines


def threads(record: DataRecord) -> str:
    """Return which threads of the program run, empty for none."""
    return " ".join(str(number) for number in range(8) if record.threads >> number & 1)


def joined(lines: Iterable[Line]) -> Line:
    """Return lines as one, with line ends between them."""
    shown = list(lines)
    pieces: Line = list(shown[0]) if shown else []
    for _, line in pairwise(shown):
        pieces += [("", "\n"), *line]
    return pieces


def plain(lines: Iterable[Line]) -> str:
    """Return lines as text without styles."""
    return "\n".join("".join(text for _, text in line).rstrip() for line in lines)
