"""Conversion of a data record to the state for readers, or to the error that names a fault."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dmc41x3.i18n import phrase
from dmc41x3.language.codes import STOP_TEXTS
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import DataRecord
from maya_un.axes import AXES
from maya_un.config import Config, Units
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
    Unreachable,
)
from maya_un.events import EmergencyStopped, FaultEntered, LimitHit, MotionStopped, Trouble
from maya_un.kinematics.closed import tension
from maya_un.kinematics.mechanism import Mechanism
from maya_un.schema.robot import Signals
from maya_un.values import Joints, Mode, Notice, Point, Progress, State

NORMAL_ENDS = frozenset({0, 1, 100, 101})
"""Stop codes of motions that ran as commanded (independent and coordinated)."""

_RUNS = 0
_FORWARD, _REVERSE, _ST, _ABORT_INPUT, _ERROR, _AMPLIFIER = 2, 3, 4, 6, 8, 15

Order = tuple[int, int, int]
"""Places of Maya's axes a, b, c in the data record."""

Flags = tuple[bool, bool, bool]
"""A yes or no for each of a, b, c."""


def indices(config: Config) -> Order:
    """Return the place in the data record of Maya's axes a, b, c, from their letters."""
    a, b, c = (LETTERS.index(axis.letter) for axis in (config.axes.a, config.axes.b, config.axes.c))
    return a, b, c


def limits(record: DataRecord, config: Config, order: Order) -> tuple[Flags, Flags]:
    """Return which forward and which reverse switches of a, b, c read active; an end without a switch never does.

    The input of an end without a switch is open, and reads active on a controller with active-high switches.
    """
    places = [(config.axes[axis], record.axes[place]) for axis, place in enumerate(order)]
    fa, fb, fc = (of.switch_at_maximum and axis.forward_limit_active for of, axis in places)
    ra, rb, rc = (of.switch_at_minimum and axis.reverse_limit_active for of, axis in places)
    return (fa, fb, fc), (ra, rb, rc)


def grave(record: DataRecord, order: Order, members: Sequence[int] = (0, 1, 2)) -> MayaError | None:
    """Return the gravest error of one of `members` (0 to 2 for a to c), None without one.

    Abort input comes before amplifier, following error and limit, because the later ones follow from the earlier.
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
    """Return the error for an independent motion of an axis: this program's motions are coordinated sequences."""
    for i, place in enumerate(order):
        axis = record.axes[place]
        if axis.moving and not axis.coordinated and axis.stop_code == _RUNS:
            return ForeignMotion(axis=AXES[i])
    return None


def cause(record: DataRecord, order: Order, members: Sequence[int]) -> MayaError | None:
    """Return why `members` are not at the end of their motion, None if they are."""
    found = grave(record, order, members)
    if found is not None:
        return found
    axes = [(AXES[i], record.axes[order[i]]) for i in members]
    for name, axis in axes:
        if axis.stop_code not in NORMAL_ENDS and axis.stop_code != _ST:
            reason = STOP_TEXTS.get(axis.stop_code, phrase("unknown code"))
            return UnexpectedStop(axis=name, stop_code=axis.stop_code, reason=reason)
    for name, axis in axes:
        if axis.motor_off:
            return MotorOff(axis=name)
    # Last: the controller also stops the partners of an axis with an error.
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


_BLANK = (False, False, False)


@dataclass(frozen=True, slots=True)
class ControllerStatus:
    """State of the controller layer beside the record: mode, whether homed, progress, fault, speed override."""

    time: float
    mode: Mode
    homed: bool
    progress: Progress | None
    fault: MayaError | None
    override: float = 1.0


class StateBuilder:
    """Turns data records (counts, bits) into states (rad, m, s)."""

    def __init__(self, config: Config, units: Units, mechanism: Mechanism, order: Order) -> None:
        self._config = config
        self._units = units
        self._mechanism = mechanism
        self._order = order

    def state(self, record: DataRecord | None, standing: ControllerStatus) -> State:
        """Return the state for the latest record, or for no record yet."""
        error = standing.fault
        fault = None if error is None else Notice(error.code, str(error))
        if record is None:
            return _unknown(standing, fault)
        a, b, c = (record.axes[place] for place in self._order)
        counts = (a.position, b.position, c.position)
        joints = self._units.to_joints(counts) if standing.homed else None
        unit = self._units.per_unit
        forward, reverse = limits(record, self._config, self._order)
        return State(
            time=standing.time,
            mode=standing.mode,
            homed=standing.homed,
            counts=counts,
            joints=joints,
            point=None if joints is None else self._place(joints),
            velocity=(a.velocity / unit[0], b.velocity / unit[1], c.velocity / unit[2]),
            moving=a.moving or b.moving or c.moving,
            motors_on=(not a.motor_off, not b.motor_off, not c.motor_off),
            forward_limit=forward,
            reverse_limit=reverse,
            stop_code=(a.stop_code, b.stop_code, c.stop_code),
            gripper_closed=self.gripper_closed(record),
            progress=standing.progress,
            fault=fault,
            override=standing.override,
        )

    def signals(self, record: DataRecord, state: State) -> Signals:
        """Return the signals in a record, whose state is `state`."""
        a, b, c = (record.axes[place] for place in self._order)
        unit = self._units.per_unit
        pull: tuple[float, float] | None = None
        if state.joints is not None and state.point is not None:
            pull = tension(*self._mechanism.section(state.joints), self._mechanism.width)
        return Signals(
            time=state.time,
            following_error=(a.error / unit[0], b.error / unit[1], c.error / unit[2]),
            torque=(a.torque, b.torque, c.torque),
            tension=pull,
            inputs=_bits(record.inputs[0]),
            outputs=_bits(record.outputs[0]),
        )

    def _place(self, joints: Joints) -> Point | None:
        """Return the gripper point, None if lines of such lengths cannot meet: the counts are wrong then."""
        try:
            return self._mechanism.fk(joints)
        except Unreachable:
            return None

    def gripper_closed(self, record: DataRecord) -> bool:
        """Return whether the gripper is closed, from the output bit."""
        grip = self._config.gripper
        high = bool(record.outputs[0] >> (grip.output - 1) & 1)
        return high is (grip.closed_by == "set")


def _bits(bank: int) -> tuple[bool, ...]:
    """Return the eight bits of a bank of inputs or outputs, the lowest first."""
    return tuple(bool(bank >> bit & 1) for bit in range(8))


def _unknown(standing: ControllerStatus, fault: Notice | None) -> State:
    return State(
        time=standing.time,
        mode=standing.mode,
        homed=False,
        counts=(0, 0, 0),
        joints=None,
        point=None,
        velocity=(0.0, 0.0, 0.0),
        moving=False,
        motors_on=_BLANK,
        forward_limit=_BLANK,
        reverse_limit=_BLANK,
        stop_code=(0, 0, 0),
        gripper_closed=False,
        progress=None,
        fault=fault,
        override=standing.override,
    )
