"""The interface of a robot for the layers above: the object itself in one process, a client across a ROS graph."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from maya_un.config import Config
from maya_un.robot.plan import ActionDetail, Pose, PrimitivePreview
from maya_un.robot.primitives import Primitive

OnPhase = Callable[[str], None]
"""Told the name of each phase as it begins."""


class Robot(Protocol):
    """The skills of Maya: one primitive at a time, worked out and checked whole before anything moves."""

    @property
    def config(self) -> Config:
        """The machine's constants."""
        ...

    @property
    def pose(self) -> Pose:
        """The present pose; its joints are None before homing."""
        ...

    @property
    def can_teleop(self) -> bool:
        """Whether the robot accepts a command: homed, not moving, not in use by another client."""
        ...

    @property
    def holding(self) -> bool | None:
        """Whether the gripper holds a part, None where nobody knows; no sensor tells."""
        ...

    def seen(self, *, holding: bool) -> None:
        """Take a person's word for what the closed gripper holds, until it is opened or closed again."""
        ...

    def preview(self, primitive: Primitive, start: Pose) -> PrimitivePreview:
        """Return what `primitive` would be from `start`; sends nothing, and raises what `run` would for it.

        That is `Unreachable`, `PathRefused`, `NotHomed`, `GripperNotEmpty` or `GripperEmpty`.
        """
        ...

    def inspect(self, primitive: Primitive, start: Pose, samples: int = 200) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and where it ends; raises as `preview`.

        Every motion has so many `samples`.
        """
        ...

    async def run(self, primitive: Primitive, on_phase: OnPhase | None = None) -> None:
        """Do `primitive` and return when it is done; every phase is an event and told to `on_phase`.

        A refusal moves nothing. Raises `NotConnected`, `Faulted`, `NotHomed`, `Busy`, the errors of `preview`, and
        `Stopped` or a `MachineError` if the motion ended early. Cancelling it stops on the path; the gripper keeps its
        state.
        """
        ...
