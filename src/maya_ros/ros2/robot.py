"""The parts of a robot that its interfaces for ROS 2 need beside the graph."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import NamedTuple

from maya_ros.graph.halts import Halts
from maya_ros.graph.timing import MotionTimer
from maya_un.values import Joints


async def _at_once() -> None:
    """Wait for nothing."""


class RobotInterface(NamedTuple):
    """The parts of a robot that are not in the graph: its description (URDF), the check of its motions, and its joints.

    `joints` returns them as they are now, None before homing. `halts` counts its stops and faults. `scaled` is whether
    its clock is not real time. `settled` waits until `joints` shows the end of a motion that has ended.
    """

    description: str
    timer: MotionTimer
    joints: Callable[[], Joints | None]
    halts: Halts
    scaled: bool
    settled: Callable[[], Awaitable[None]] = _at_once
