"""The registers of axes and planes: range, step, default, and when they may be changed.

Facts of the DMC-41x3 at TM 1000. Values are rounded towards zero to a multiple of their step, as the controller does.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from maya_un.galil.codes import ErrorCode
from maya_un.virtual.refusal import Refused

_LARGEST = 2147483647.0
_SMALLEST = -2147483648.0
_FASTEST = 15_000_000.0
_STEEPEST = 1_073_740_800.0
_VOLTS = 9.9982
_VOLT = 20.0 / 65536.0


class When(Enum):
    """When a register of an axis may be changed."""

    ALWAYS = "at any time"
    RESTING = "not while the axis moves"
    BRAKING = "not in a move to a place, except while it is being stopped"
    OFF = "with the motor off"


class Register(NamedTuple):
    """One register: numbers in controller units; `places` are the decimals its `?` prints."""

    minimum: float
    maximum: float
    default: float
    step: float = 1.0
    when: When = When.ALWAYS
    places: int = 0
    choices: frozenset[float] = frozenset()

    def rounded(self, value: float) -> float:
        """Return `value` as the register keeps it; raises `Refused` for one out of range."""
        if not self.minimum <= value <= self.maximum or (self.choices and value not in self.choices):
            raise Refused(ErrorCode.OUT_OF_RANGE)
        if self.choices:
            return value
        return int(value / self.step + (1e-9 if value >= 0 else -1e-9)) * self.step


AXIS: dict[str, Register] = {
    "SP": Register(-_FASTEST, _FASTEST, 25000.0, 2.0),
    "AC": Register(1024.0, _STEEPEST, 256000.0, 1024.0),
    "DC": Register(1024.0, _STEEPEST, 256000.0, 1024.0, When.BRAKING),
    "SD": Register(1024.0, _STEEPEST, 256000.0, 1024.0, When.BRAKING),
    "HV": Register(0.0, _FASTEST, 256.0, 2.0),
    "IT": Register(1.0 / 256.0, 1.0, 1.0, 1.0 / 256.0, places=4),
    "KP": Register(0.0, 1023.875, 6.0, 0.125, places=2),
    "KI": Register(0.0, 255.999, 0.0, 1.0 / 1024.0, places=4),
    "KD": Register(0.0, 4095.875, 64.0, 0.125, places=2),
    "TL": Register(0.0, _VOLTS, _VOLTS, _VOLT, places=4),
    "TK": Register(0.0, _VOLTS, 0.0, _VOLT, places=4),
    "OF": Register(-_VOLTS, _VOLTS, 0.0, _VOLT, places=4),
    "ER": Register(-1.0, _LARGEST, 16384.0),
    "OE": Register(0.0, 3.0, 0.0),
    "LD": Register(0.0, 3.0, 0.0),
    "FL": Register(_SMALLEST, _LARGEST, _LARGEST),
    "BL": Register(_SMALLEST, _LARGEST, _SMALLEST),
    "MT": Register(-4.0, 4.0, 1.0, 0.5, When.OFF, 1, frozenset({1, -1, 2, -2, 2.5, -2.5, 4, -4})),
    "CE": Register(0.0, 15.0, 0.0, 1.0, When.RESTING),
    "BR": Register(-1.0, 1.0, 0.0, 1.0, When.RESTING),
    "BW": Register(0.0, 4096.0, 0.0),
    "ZA": Register(_SMALLEST, _LARGEST, 0.0),
}
"""Registers that every axis has."""

PLANE: dict[str, Register] = {
    "VS": Register(2.0, _FASTEST, 25000.0, 2.0),
    "VA": Register(1024.0, _STEEPEST, 256000.0, 1024.0),
    "VD": Register(1024.0, _STEEPEST, 256000.0, 1024.0, When.RESTING),
    "VR": Register(0.0, 10.0, 1.0, 1.0 / 65536.0, places=4),
    "VV": Register(0.0, _FASTEST, 0.0, 2.0),
}
"""Registers that both coordinate systems have."""

POSITION = Register(_SMALLEST, _LARGEST, 0.0)
"""What a position or a distance may be [counts]."""

JOG = Register(-_FASTEST, _FASTEST, 25000.0, 2.0)
"""What a jog speed may be [counts/s]."""


def defaults(table: dict[str, Register]) -> dict[str, float]:
    """Return a fresh set of registers as the factory leaves them."""
    return {name: register.default for name, register in table.items()}
