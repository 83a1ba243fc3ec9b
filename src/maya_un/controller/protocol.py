"""What the floors above need of a controller; in one process the object itself, across a ROS graph a client."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from maya_un.config import Config
from maya_un.controller.inspection import Inspection
from maya_un.controller.run import OnVia
from maya_un.events import EventLog
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Zone
from maya_un.motion.path import Route
from maya_un.schema.robot import Jogged
from maya_un.values import Joints, Progress, State, StopReport


@dataclass(frozen=True, slots=True)
class Preview:
    """What a motion will be, known before it starts.

    `duration` [s]; `lowest` and `highest` gripper point on the way [m]; `end` the joints it ends at (whole
    counts, in rad and m); `vias` when each waypoint between the ends is passed [s].
    """

    duration: float
    lowest: float
    highest: float
    end: Joints
    vias: tuple[float, ...] = ()


class Controller(Protocol):
    """Joint-space control of Maya: one wish at a time, every path checked whole, stop always possible.

    Motion raises `NotConnected`, `Faulted`, `NotHomed`, `Busy`, `Unreachable` or `PathRefused` before anything
    is sent; `Stopped` when somebody stopped it; a `MachineError` when the machine did something unexpected.
    Cancelling the awaiting task stops on the path and ends when the axes are at rest.
    """

    @property
    def config(self) -> Config:
        """The machine's constants."""
        ...

    @property
    def mechanism(self) -> Mechanism:
        """Its geometry."""
        ...

    @property
    def workspace(self) -> Workspace:
        """Where it can go; strokes as measured once homed."""
        ...

    @property
    def zones(self) -> tuple[Zone, ...]:
        """What it keeps out of: the zones of the configuration, until `set_zones` names others."""
        ...

    def set_zones(self, zones: Sequence[Zone]) -> None:
        """Keep out of these zones instead, for as long as this program runs; raises `Busy` while something moves."""
        ...

    @property
    def events(self) -> EventLog:
        """Facts in order."""
        ...

    @property
    def state(self) -> State:
        """Latest state."""
        ...

    @property
    def stops(self) -> int:
        """Number of stops and aborts so far; a change between two motions shows one."""
        ...

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one; a slow reader skips to the newest."""
        ...

    def progress(self) -> Progress | None:
        """How far the motion under way has come, None at rest."""
        ...

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check `path` (joints in rad, m, m) as a motion would and tell what it would be; sends nothing."""
        ...

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`, None where it goes nowhere; raises as `preview` does."""
        ...

    async def home(self) -> None:
        """Find the switches, define the counts, measure the strokes."""
        ...

    async def move(self, target: Joints, *, speed: float = 1.0) -> None:
        """Go to `target` (rad, m, m) on a straight line in joint space; `speed` 0 to 1 of the limits."""
        ...

    async def follow(self, path: Route, *, speed: float = 1.0, on_via: OnVia | None = None) -> None:
        """Go along `path`, whose first point is where the robot is; raises `TrajectoryRefused` otherwise.

        `on_via` is told the number of every waypoint between the ends, from 0, as it is passed; in order, each once,
        before this returns, and none after a stop.
        """
        ...

    async def jog(self, axis: str, distance: float, *, speed: float = 1.0, clip: bool = False) -> Jogged:
        """Move along one axis by `distance` (rad or m) and tell how far it went; the gripper's axes go straight.

        Axes are a, b, c, and x, y, z and r of the gripper, r outward along the boom. With `clip` it goes as far as
        the workspace allows and comes to rest before what ends it; without, more than that is refused.
        """
        ...

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper and wait until it has moved."""
        ...

    async def stop(self) -> StopReport:
        """Begin to brake at once, on the path, past every queue; answer how long and how far it takes."""
        ...

    async def override(self, ratio: float) -> None:
        """Scale the speed of the motion under way and of all later ones by `ratio`, from 0.01 to 1."""
        ...

    async def pause(self, *, ahead: bool = False) -> StopReport:
        """Brake on the path and hold all motion until `resume`; answer how long and how far it takes.

        With `ahead` also where nothing is under way now; otherwise that raises `CannotPause`, as a homing does.
        """
        ...

    async def resume(self) -> None:
        """Let motion go on after a pause; raises `NotPaused`."""
        ...

    async def abort(self) -> None:
        """Stop without deceleration."""
        ...

    async def recover(self, *, take_over: bool = False) -> None:
        """Clear a fault, once its cause is gone; moves nothing.

        With `take_over` the controller is taken from another program that owns it, at rest.
        """
        ...
