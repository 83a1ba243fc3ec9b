"""The plan of a primitive, computed and checked whole before anything moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from maya_un.controller.inspection import Inspection
from maya_un.controller.protocol import Preview
from maya_un.motion.path import Path
from maya_un.robot.gripper import GripperState
from maya_un.schema.previews import PhasePreview
from maya_un.values import Joints


class Pose(NamedTuple):
    """State at the start or end of a primitive: joints (rad, m, m), None before homing; what the gripper may hold."""

    joints: Joints | None
    gripper: GripperState


@dataclass(frozen=True, slots=True)
class HomingAction:
    """Find the switches; how long that takes depends on where the robot really is, so nobody knows before."""

    phase: str
    end: Joints

    @property
    def duration(self) -> None:
        """Not known before [s]."""
        return None

    def phases(self) -> tuple[PhasePreview, ...]:
        """Return its one phase."""
        return (PhasePreview(self.phase, None),)


@dataclass(frozen=True, slots=True)
class TravelAction:
    """Go along `path` from where the robot is, as `preview` says, without a stop.

    `turn` is the phase that begins where the via of that number is passed, with its name; None where it is all one.
    """

    phase: str
    path: Path
    preview: Preview
    turn: tuple[int, str] | None = None

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return self.preview.duration

    def phases(self) -> tuple[PhasePreview, ...]:
        """Return its phases in order."""
        if self.turn is None:
            return (PhasePreview(self.phase, self.duration),)
        via, name = self.turn
        passed = self.preview.vias[via]
        return PhasePreview(self.phase, passed), PhasePreview(name, self.duration - passed)


@dataclass(frozen=True, slots=True)
class GripAction:
    """Open or close the gripper; `duration` is the wait until it has moved [s]. `grasps` a part when it closes."""

    phase: str
    open: bool
    duration: float
    grasps: bool = False

    def phases(self) -> tuple[PhasePreview, ...]:
        """Return its one phase."""
        return (PhasePreview(self.phase, self.duration),)


Action = HomingAction | TravelAction | GripAction


@dataclass(frozen=True, slots=True)
class ActionDetail:
    """An action in detail: its phases, its duration [s] (None for a homing), and its motion, None where it has none."""

    phases: tuple[PhasePreview, ...]
    duration: float | None
    motion: Inspection | None


@dataclass(frozen=True, slots=True)
class PrimitivePreview:
    """Preview of a primitive.

    `duration` [s] is the sum of the phases, None with a homing among them. `lowest` and `highest` bound the
    gripper point on the way [m], None where nothing travels. `end` is where it leaves the robot.
    """

    duration: float | None
    phases: tuple[PhasePreview, ...]
    lowest: float | None
    highest: float | None
    end: Pose


@dataclass(frozen=True, slots=True)
class PrimitivePlan:
    """The actions of one primitive in order, every path in them checked, and the pose they lead to."""

    actions: tuple[Action, ...]
    end: Pose

    def preview(self) -> PrimitivePreview:
        """Return what the plan will be."""
        travels = [action.preview for action in self.actions if isinstance(action, TravelAction)]
        durations = [action.duration for action in self.actions]
        known = [duration for duration in durations if duration is not None]
        return PrimitivePreview(
            duration=sum(known) if len(known) == len(durations) else None,
            phases=tuple(phase for action in self.actions for phase in action.phases()),
            lowest=min((travel.lowest for travel in travels), default=None),
            highest=max((travel.highest for travel in travels), default=None),
            end=self.end,
        )
