"""From what the data record says at the end of a motion to the error that names it."""

from __future__ import annotations

from collections.abc import Sequence

from dmc41x3.language.codes import STOP_TEXTS
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import DataRecord
from maya_un.config import Config
from maya_un.errors import (
    AbortInput,
    AmplifierFault,
    FollowingError,
    ForeignMotion,
    LimitReached,
    MayaError,
    MotorOff,
    Stopped,
    UnexpectedStop,
)
from maya_un.events import EmergencyStopped, FaultEntered, LimitHit, MotionStopped, Trouble
from maya_un.values import AXES

NORMAL_ENDS = frozenset({0, 1, 100, 101})
"""Stop codes of motions that ran as commanded (independent and coordinated)."""

_RUNS = 0
_FORWARD, _REVERSE, _ST, _ABORT_INPUT, _ERROR, _AMPLIFIER = 2, 3, 4, 6, 8, 15

Order = tuple[int, int, int]
"""Places of Maya's axes a, b, c in the data record."""


def indices(config: Config) -> Order:
    """Return the place in the data record of Maya's axes a, b, c, from their letters."""
    a, b, c = (LETTERS.index(axis.letter) for axis in (config.axes.a, config.axes.b, config.axes.c))
    return a, b, c


def grave(record: DataRecord, order: Order, members: Sequence[int] = (0, 1, 2)) -> MayaError | None:
    """Return the gravest thing that befell one of `members` (0 to 2 for a to c), None where nothing did.

    Abort input before amplifier before following error before limit: the later ones follow from the earlier.
    """
    by_code = {record.axes[order[i]].stop_code: AXES[i] for i in members}
    if _ABORT_INPUT in by_code:
        return AbortInput()
    if _AMPLIFIER in by_code or record.amplifier_status:
        return AmplifierFault(status=f"{record.amplifier_status:#010x}")
    if _ERROR in by_code:
        return FollowingError(axis=by_code[_ERROR])
    for code, side in ((_FORWARD, "forward"), (_REVERSE, "reverse")):
        if code in by_code:
            return LimitReached(axis=by_code[code], side=side)
    return None


def foreign(record: DataRecord, order: Order) -> ForeignMotion | None:
    """Return the error for an independent motion of an axis: our motions are sequences of coordinated axes."""
    for i, place in enumerate(order):
        axis = record.axes[place]
        if axis.moving and not axis.coordinated and axis.stop_code == _RUNS:
            return ForeignMotion(axis=AXES[i])
    return None


def cause(record: DataRecord, order: Order, members: Sequence[int]) -> MayaError | None:
    """Return why `members` are not where their motion should have brought them, None where all is well."""
    found = grave(record, order, members)
    if found is not None:
        return found
    axes = [(AXES[i], record.axes[order[i]]) for i in members]
    for name, axis in axes:
        if axis.stop_code not in NORMAL_ENDS and axis.stop_code != _ST:
            reason = STOP_TEXTS.get(axis.stop_code, "unknown code")
            return UnexpectedStop(axis=name, stop_code=axis.stop_code, reason=reason)
    for name, axis in axes:
        if axis.motor_off:
            return MotorOff(axis=name)
    # Last: partners of an axis that something befell were stopped too.
    return Stopped() if any(axis.stop_code == _ST for _, axis in axes) else None


def kind(error: MayaError) -> type[Trouble | MotionStopped]:
    """Return the event that announces an error."""
    match error:
        case LimitReached():
            return LimitHit
        case AbortInput():
            return EmergencyStopped
        case Stopped():
            return MotionStopped
        case _:
            return FaultEntered
