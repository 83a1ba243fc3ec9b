"""The table of all commands, and the part of the language that the twin implements.

An entry of the catalogue that is neither accepted without effect nor refused is implemented: it does what the
controller does, or sets or returns a value that the twin uses.
"""

from __future__ import annotations

from enum import Enum
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

from dmc41x3.language.catalogue import CATALOGUE
from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.commands import array, axis, communication, coordinated, gearing, interrogation, program, system
from dmc41x3.twin.context import Answer, CallerContext, Handler


class CoverageClass(Enum):
    """Support of an entry by the twin."""

    IMPLEMENTED = "implemented"
    ACCEPTED = "accepted"
    REFUSED = "refused"


class Coverage(NamedTuple):
    """The class of an entry, the reason if it is not implemented, and the error code if it is refused."""

    kind: CoverageClass
    reason: str = ""
    code: ErrorCode | None = None


_SERVO = "stored and reported; the filter of the servo does not change how the plant follows its reference"
_CURRENT = "stored and reported; the motors of the plant have no current"
_SERIAL = "no device is connected to the second serial port"
_PHASE = "stored and reported; the motors of the plant have no phases"
_MODBUS = "no Modbus device is connected"

_REASONS: dict[str, str] = {
    **dict.fromkeys(("DV", "FA", "FV", "IL", "KD", "KI", "KP", "NB", "NF", "NZ", "PL"), _SERVO),
    **dict.fromkeys(("AG", "AU", "LC"), _CURRENT),
    **dict.fromkeys(("BD", "BM"), _PHASE),
    **dict.fromkeys(("CC", "CI", "P2CD", "P2CH", "P2NM", "P2ST", "US", "#COMINT"), _SERIAL),
    **dict.fromkeys(("ME", "MW"), f"stored and reported; {_MODBUS}"),
    "AF": "stored and reported; no analog signal carries a position",
    "AQ": "stored and reported; an analog input returns the voltage that was set",
    "AZ": "no amplifier error is latched: a fault is reported as long as it lasts",
    "BI": "only 0 is accepted; without Hall sensors, other values are refused with 110",
    "BR": "stored and reported; the amplifier drives any motor",
    "CE": "stored and reported; it does not change how encoders are read",
    "EI": "stored and reported; no event packets are sent",
    "KS": "stored and reported; step pulses have no delay",
    "QH": "returns 0; there are no Hall sensors",
    "QQ": "no sample takes too long",
    "UI": "no event packets are sent",
    "#FWERR": "no sample takes too long",
}

_REFUSED: dict[str, tuple[ErrorCode, str]] = {
    "AO": (ErrorCode.HANDLE_CLOSED, _MODBUS),
    "BC": (ErrorCode.NO_HALLS, "there are no Hall sensors"),
    "MB": (ErrorCode.HANDLE_CLOSED, _MODBUS),
    "REM": (ErrorCode.PROGRAM_ONLY, "a remark that programs on a host remove; the controller accepts RE"),
}


def _classified(name: str) -> Coverage:
    if name in _REFUSED:
        code, reason = _REFUSED[name]
        return Coverage(CoverageClass.REFUSED, reason, code)
    if name in _REASONS:
        return Coverage(CoverageClass.ACCEPTED, _REASONS[name])
    return Coverage(CoverageClass.IMPLEMENTED)


COVERAGE = MappingProxyType({name: _classified(name) for name in CATALOGUE})
"""The class of every entry of the catalogue."""


def covered() -> float:
    """Return the fraction of the entries that are implemented."""
    return sum(entry.kind is CoverageClass.IMPLEMENTED for entry in COVERAGE.values()) / len(COVERAGE)


_HANDLERS: dict[str, Handler] = {
    **axis.REGISTER_TABLE,
    **axis.MOTION_TABLE,
    **coordinated.LINEAR_TABLE,
    **coordinated.VECTOR_TABLE,
    **coordinated.CONTOUR_TABLE,
    **gearing.TABLE,
    **axis.HARDWARE_TABLE,
    **interrogation.INQUIRY_TABLE,
    **system.TABLE,
    **communication.ETHERNET_TABLE,
    **interrogation.MESSAGE_TABLE,
    **communication.PERIPHERALS_TABLE,
    **array.TABLE,
    **program.TABLE,
}


def _noted(name: str, handler: Handler, reason: str, context: CallerContext, text: str) -> Answer:
    """Execute a command that has no effect, and note that."""
    answer = handler(context, text)
    if answer is None:
        context.unit.note(f"{name} has no effect on this twin: {reason}")
    return answer


def _with_notes(name: str, handler: Handler) -> Handler:
    coverage = COVERAGE.get(name)
    if coverage is None or coverage.kind is not CoverageClass.ACCEPTED:
        return handler
    return partial(_noted, name, handler, coverage.reason)


TABLE: dict[str, Handler] = {name: _with_notes(name, handler) for name, handler in _HANDLERS.items()}
"""Every command that this controller knows."""
