"""Live values by their names in the language: which of them a data record holds, and in which unit they are.

A channel is anything that MG prints as one number: an operand (`_TPA`), a function (`@IN[1]`), a variable or an
expression. One record (QR) holds many of them at the same sample; the others are asked for with MG.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from types import MappingProxyType

from dmc41x3.language.hardware import ALIASES, LETTERS, SAMPLES
from dmc41x3.language.record import AxisRecord, DataRecord

_OPERAND = re.compile(r"_([A-Z]{2})([A-HXYZW])")
_BIT = re.compile(r"@(IN|OUT)\[([0-9]{1,2})\]")

Reading = Callable[[DataRecord], float]
"""How a channel is read from a record."""

_FROM_AXIS: MappingProxyType[str, Callable[[AxisRecord], float]] = MappingProxyType(
    {
        "TP": lambda axis: axis.position,
        "RP": lambda axis: axis.reference,
        "TE": lambda axis: axis.error,
        "TD": lambda axis: axis.auxiliary,
        "TV": lambda axis: axis.velocity,
        "TT": lambda axis: axis.torque,
        "SC": lambda axis: axis.stop_code,
        "BG": lambda axis: axis.moving,
        "MO": lambda axis: axis.motor_off,
        "LF": lambda axis: not axis.forward_limit_active,
        "LR": lambda axis: not axis.reverse_limit_active,
        "ZA": lambda axis: axis.user,
    }
)

_KINDS = (
    ("position", "counts", "TP RP TD PA PR DP DE RL FL BL IP LE AV VP"),
    ("following error", "counts", "TE ER"),
    ("velocity", "counts/s", "TV SP JG HV VS VV VM"),
    ("acceleration", "counts/s²", "AC DC SD VA VD"),
    ("motor command", "V", "TT TL TK OF IL"),
)
_KIND = MappingProxyType({name: (what, meant) for what, meant, names in _KINDS for name in names.split()})


def unit(channel: str) -> str:
    """Return the unit of a channel, empty for a plain number and for expressions, whose unit nobody knows."""
    return _kind(channel)[1]


def quantity(channel: str) -> str:
    """Return what a channel is, `position` or the like; `value` where nobody knows."""
    return _kind(channel)[0]


def _kind(channel: str) -> tuple[str, str]:
    if channel == "TIME":
        return "time of the controller", "samples"
    if re.fullmatch(r"@AN\[.*\]", channel):
        return "analog input", "V"
    found = re.fullmatch(r"_([A-Z]{2})\w?", channel)
    return _KIND.get(found[1], ("value", "")) if found is not None else ("value", "")


def reading(channel: str, axes: int) -> Reading | None:
    """Return how `channel` is read from a record of so many axes, None where it is not in it.

    Digital inputs are those of the first two banks, outputs of the same (DMC-41x3: 1 to 16).
    """
    if found := _OPERAND.fullmatch(channel):
        return _axis_reading(found[1], LETTERS.index(found[2].translate(ALIASES)), axes)
    if (found := _BIT.fullmatch(channel)) and 1 <= int(found[2]) <= 16:
        return _bit_reading(found[1], int(found[2]) - 1)
    return None


def _axis_reading(name: str, axis: int, axes: int) -> Reading | None:
    field = _FROM_AXIS.get(name)
    if field is None or axis >= axes:
        return None
    return lambda record: float(field(record.axes[axis]))


def _bit_reading(name: str, bit: int) -> Reading:
    def read(record: DataRecord) -> float:
        banks = record.inputs if name == "IN" else record.outputs
        return float(banks[bit // 8] >> bit % 8 & 1)

    return read


def columns(axes: int) -> tuple[str, ...]:
    """Return what is worth watching where nobody says what: position, error, velocity, torque of every axis."""
    return tuple(f"_{name}{letter}" for letter in LETTERS[:axes] for name in ("TP", "TE", "TV", "TT"))


class SampleClock:
    """Time of records [s] from their sample numbers, of which only the low 16 bits are sent.

    `period` is TM [µs]: 1000 means 1024 samples in a second (DMC-41x3, command TM). Records must be less than
    32 s apart, which is half of what 16 bits count.
    """

    def __init__(self, period: float = 1000.0) -> None:
        self._second = SAMPLES * 1000.0 / period
        self._last: int | None = None
        self._passed = 0

    def at(self, sample: int) -> float:
        """Return the time of `sample` since the first one asked about; later records have later numbers."""
        if self._last is not None:
            self._passed += (sample - self._last) % (1 << 16)
        self._last = sample
        return self._passed / self._second
