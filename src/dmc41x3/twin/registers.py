"""The registers of axes and planes: range, step, default, and when they may be changed.

The data are those of the DMC-41x3 at TM 1000; `Register.sampled` converts them to another sample period. Values are
rounded towards zero to a multiple of their step, as in the controller.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.expressions import Rejection

_LARGEST = 2147483647.0
_SMALLEST = -2147483648.0
_FASTEST = 15_000_000.0
_STEEPEST = 1_073_740_800.0
_VOLTS = 9.9982
_VOLT = 20.0 / 65536.0


class WriteCondition(Enum):
    """When a register of an axis may be changed."""

    ALWAYS = "at any time"
    RESTING = "not while the axis moves"
    BRAKING = "not in a move to a place, except while it is being stopped"
    OFF = "with the motor off"
    COMMUTATED = "with the axis made brushless by BA"


class Register(NamedTuple):
    """One register: numbers in controller units; `places` are the decimals in the reply to `?`.

    `power` is how its step scales with the sampling rate: 1 for a speed, 2 for an acceleration, 0 for neither.
    """

    minimum: float
    maximum: float
    default: float
    step: float = 1.0
    when: WriteCondition = WriteCondition.ALWAYS
    places: int = 0
    choices: frozenset[float] = frozenset()
    power: int = 0

    def rounded(self, value: float) -> float:
        """Return `value` as the register stores it; raises `Rejection` if it is out of range."""
        if not self.minimum <= value <= self.maximum or (self.choices and value not in self.choices):
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        if self.choices:
            return value
        return int(value / self.step + (1e-9 if value >= 0 else -1e-9)) * self.step

    def sampled(self, period: int) -> Register:
        """Return the register at a sample period of `period` [µs] (TM): speeds and rates scale by its `power`."""
        if not self.power or period == TM.default:
            return self
        scale = (TM.default / period) ** self.power
        least = self.minimum * scale if self.minimum > 0.0 else self.minimum
        return self._replace(minimum=least, step=self.step * scale)


TM = Register(125.0, 20000.0, 1000.0, 125.0)
"""Sample period [µs]. The minimum depends on the number of axes: 125 µs for each two of them."""

AXIS: dict[str, Register] = {
    "SP": Register(-_FASTEST, _FASTEST, 25000.0, 2.0, power=1),
    "AC": Register(1024.0, _STEEPEST, 256000.0, 1024.0, power=2),
    "DC": Register(1024.0, _STEEPEST, 256000.0, 1024.0, WriteCondition.BRAKING, power=2),
    "SD": Register(1024.0, _STEEPEST, 256000.0, 1024.0, WriteCondition.BRAKING, power=2),
    "HV": Register(0.0, _FASTEST, 256.0, 2.0, power=1),
    "IT": Register(1.0 / 256.0, 1.0, 1.0, 1.0 / 256.0, places=4),
    "KP": Register(0.0, 1023.875, 6.0, 0.125, places=2),
    "KI": Register(0.0, 255.999, 0.0, 1.0 / 1024.0, places=4),
    "KD": Register(0.0, 4095.875, 64.0, 0.125, places=2),
    "IL": Register(-_VOLTS, _VOLTS, _VOLTS, _VOLT, places=4),
    "PL": Register(0.0, 0.9999, 0.0, 1.0 / 65536.0, places=4),
    "FA": Register(0.0, 8191.75, 0.0, 0.25, WriteCondition.RESTING, 2),
    "FV": Register(0.0, 8191.0, 0.0),
    "DV": Register(0.0, 1.0, 0.0),
    "NB": Register(0.0, 62.5, 0.5, 0.5, places=1),
    "NF": Register(-255.0, 255.0, 0.0),
    "NZ": Register(-128.0, 127.999, 0.0, 1.0 / 256.0, places=3),
    "TL": Register(0.0, _VOLTS, _VOLTS, _VOLT, places=4),
    "TK": Register(0.0, _VOLTS, 0.0, _VOLT, places=4),
    "OF": Register(-_VOLTS, _VOLTS, 0.0, _VOLT, places=4),
    "ER": Register(-1.0, _LARGEST, 16384.0),
    "OE": Register(0.0, 3.0, 0.0),
    "OA": Register(0.0, 1.0, 0.0),
    "OT": Register(2.0, 32000.0, 30.0, 2.0),
    "OV": Register(0.0, _VOLTS, 0.9438, _VOLT, places=4),
    "LD": Register(0.0, 3.0, 0.0),
    "FL": Register(_SMALLEST, _LARGEST, _LARGEST),
    "BL": Register(_SMALLEST, _LARGEST, _SMALLEST),
    "TW": Register(-1.0, 32767.0, 32766.0),
    "MT": Register(-4.0, 4.0, 1.0, 0.5, WriteCondition.OFF, 1, frozenset({1, -1, 2, -2, 2.5, -2.5, 4, -4})),
    "CE": Register(0.0, 15.0, 0.0, 1.0, WriteCondition.RESTING),
    "AF": Register(-1.0, 1.0, 0.0, 1.0, WriteCondition.RESTING),
    "BR": Register(-1.0, 1.0, 0.0, 1.0, WriteCondition.RESTING),
    "BW": Register(0.0, 4096.0, 0.0),
    "AG": Register(0.0, 3.0, 1.0, 1.0, WriteCondition.OFF),
    "AU": Register(0.0, 12.0, 0.0, 0.5, WriteCondition.OFF, 1),
    "BM": Register(1.0, 1_000_000.0, 2000.0, 1.0 / 65536.0, WriteCondition.COMMUTATED),
    "BD": Register(0.0, 360.0, 6.0, 1.0 / 256.0, WriteCondition.COMMUTATED),
    "KS": Register(0.25, 128.0, 2.0, 1.0 / 32.0, places=3),
    "LC": Register(-32767.0, 32767.0, 0.0),
    "YA": Register(1.0, 9999.0, 2.0, 1.0, WriteCondition.RESTING),
    "YB": Register(1.0, 9999.0, 200.0, 1.0, WriteCondition.RESTING),
    "YC": Register(1.0, 32766.0, 4000.0, 1.0, WriteCondition.RESTING),
    "YS": Register(0.0, 1.0, 0.0),
    "GR": Register(-127.0, 127.9999, 0.0, 1.0 / 65536.0, places=4),
    "GM": Register(0.0, 1.0, 0.0),
    "GD": Register(0.0, 32767.0, 0.0),
    "EM": Register(0.0, 8_388_607.0, 0.0),
    "ZA": Register(_SMALLEST, _LARGEST, 0.0),
}
"""Registers of every axis; if the manual states no range, a wide range is used."""

VIRTUAL: dict[str, Register] = {name: AXIS[name] for name in ("SP", "AC", "DC", "SD", "IT", "HV", "EM", "ZA")}
"""Registers of the virtual axes M and N."""

STEPPER_FASTEST = 3_000_000.0
"""The largest speed of an axis with a stepper motor [steps/s]."""

PLANE: dict[str, Register] = {
    "VS": Register(2.0, _FASTEST, 25000.0, 2.0, power=1),
    "VA": Register(1024.0, _STEEPEST, 256000.0, 1024.0, power=2),
    "VD": Register(1024.0, _STEEPEST, 256000.0, 1024.0, WriteCondition.RESTING, power=2),
    "VR": Register(0.0, 10.0, 1.0, 1.0 / 65536.0, places=4),
    "VV": Register(0.0, _FASTEST, 0.0, 2.0, power=1),
}
"""Registers that both coordinate systems have."""

POSITION = Register(_SMALLEST, _LARGEST, 0.0)
"""Range of a position or a distance [counts]."""

JOG = Register(-_FASTEST, _FASTEST, 25000.0, 2.0, power=1)
"""Range of a jog speed [counts/s]."""


def defaults(table: dict[str, Register]) -> dict[str, float]:
    """Return a new set of registers with their factory values."""
    return {name: register.default for name, register in table.items()}
