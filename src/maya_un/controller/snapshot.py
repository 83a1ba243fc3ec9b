"""From a data record to the state that readers see."""

from __future__ import annotations

from dataclasses import dataclass

from dmc41x3.language.record import DataRecord
from maya_un.config import Config, Units
from maya_un.controller.faults import Order
from maya_un.errors import MayaError, Unreachable
from maya_un.kinematics.mechanism import Mechanism
from maya_un.values import Joints, Mode, Notice, Point, Progress, State

_BLANK = (False, False, False)


@dataclass(frozen=True, slots=True)
class ControllerStatus:
    """What the controller floor knows beside the record: mode, whether homed, progress, fault, speed override."""

    time: float
    mode: Mode
    homed: bool
    progress: Progress | None
    fault: MayaError | None
    override: float = 1.0


class StateBuilder:
    """Turns data records (counts, bits) into states (rad, m, s)."""

    def __init__(self, config: Config, units: Units, mechanism: Mechanism, order: Order) -> None:
        self._grip = config.gripper
        self._units = units
        self._mechanism = mechanism
        self._order = order

    def state(self, record: DataRecord | None, standing: ControllerStatus) -> State:
        """Return the state for the latest record, or for none yet."""
        error = standing.fault
        fault = None if error is None else Notice(error.code, str(error))
        if record is None:
            return _unknown(standing, fault)
        a, b, c = (record.axes[place] for place in self._order)
        counts = (a.position, b.position, c.position)
        joints = self._units.to_joints(counts) if standing.homed else None
        unit = self._units.per_unit
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
            forward_limit=(a.forward_limit_active, b.forward_limit_active, c.forward_limit_active),
            reverse_limit=(a.reverse_limit_active, b.reverse_limit_active, c.reverse_limit_active),
            stop_code=(a.stop_code, b.stop_code, c.stop_code),
            gripper_closed=self.gripper_closed(record),
            progress=standing.progress,
            fault=fault,
            override=standing.override,
        )

    def _place(self, joints: Joints) -> Point | None:
        """Return the gripper point, None where lines of such lengths cannot meet: the counts are wrong then."""
        try:
            return self._mechanism.fk(joints)
        except Unreachable:
            return None

    def gripper_closed(self, record: DataRecord) -> bool:
        """Tell from the output bit whether the gripper is closed."""
        high = bool(record.outputs[0] >> (self._grip.output - 1) & 1)
        return high is (self._grip.closed_by == "set")


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
