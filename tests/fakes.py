"""A controller that records its calls and takes the time of each motion, without a machine or a wire."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from dataclasses import replace

from maya_un.config import Config, Units
from maya_un.controller.datum import GivenDatum
from maya_un.controller.homing import homed_pose
from maya_un.controller.planner import Planner, name_of
from maya_un.controller.protocol import Inspection, OnVia, Preview
from maya_un.errors import Busy, MayaError, NotOverRos, Stopped
from maya_un.events import (
    EventLog,
    GripperClosed,
    GripperOpened,
    HomingBegun,
    HomingDone,
    OutputCleared,
    OutputSet,
    SpeedChanged,
)
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Zone
from maya_un.motion import Path, Route
from maya_un.schema.robot import Jogged, LinkView
from maya_un.values import JogDirection, Joints, Mode, Notice, Progress, State, StopReport
from tests.virtual_time import elapse

HOMING_TIME = 60.0
"""Duration of a homing of the fake [s]."""


def state_of(joints: Joints | None, *, closed: bool = False, mode: Mode | None = None) -> State:
    """Return a state at rest: homed at `joints`, or not homed."""
    none = (False, False, False)
    units = Units.of(Config())
    return State(
        time=0.0,
        mode=mode or (Mode.NOT_HOMED if joints is None else Mode.IDLE),
        homed=joints is not None,
        counts=(0, 0, 0) if joints is None else units.to_counts(joints),
        joints=joints,
        point=None if joints is None else Mechanism.of(Config()).fk(joints),
        velocity=(0.0, 0.0, 0.0),
        moving=False,
        motors_on=(True, True, True),
        forward_limit=none,
        reverse_limit=none,
        stop_code=(0, 0, 0),
        gripper_closed=closed,
        progress=None,
        fault=None,
    )


class FakeController:
    """Records calls in `calls`; `fail_at` maps the number of a call (from 1) to the error it ends with."""

    def __init__(self, *, homed: bool = True, closed: bool = False) -> None:
        self.config = Config()
        self.units = Units.of(self.config)
        self.mechanism = Mechanism.of(self.config)
        self.workspace = Workspace.of(self.config)
        self.events = EventLog(asyncio.get_running_loop().time)
        self.state = state_of(self._exact(homed_pose(self.config)) if homed else None, closed=closed)
        self.calls: list[tuple[str, object]] = []
        self.fail_at: dict[int, MayaError] = {}
        self.inputs = [True] * 8
        self.previews = 0
        self.stops = 0
        self._planner = Planner(self.config, self.mechanism)
        self._stop: asyncio.Future[None] | None = None

    def names(self) -> list[str]:
        """Return the names of the calls so far."""
        return [name for name, _ in self.calls]

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The zones to avoid."""
        return self.workspace.zones

    def set_zones(self, zones: Sequence[Zone]) -> None:
        """Keep out of these zones."""
        self.workspace = self.workspace.with_zones(zones)

    async def watch(self) -> AsyncIterator[State]:
        """Yield the state once."""
        yield self.state

    def progress(self) -> Progress | None:
        """Nothing to tell."""
        return None

    def signals(self) -> None:
        """Nothing: another node has them."""

    async def interrogate(self, command: str) -> str:
        """Raise `NotOverRos`: another node has the controller."""
        raise NotOverRos(request="terminal")

    def link(self, speed: float) -> LinkView:
        """Return whether the controller is connected; the quality of the link is known to its node alone."""
        return LinkView(self.state.mode is not Mode.DISCONNECTED)

    @property
    def run(self) -> None:
        """Nothing to tell."""

    @property
    def datum(self) -> GivenDatum | None:
        """None: switches have shown the position."""
        return None

    async def give_datum(self, joints: Joints, *, by: str) -> None:
        """Record the call."""
        self.calls.append(("give_datum", (joints, by)))

    async def confirm_datum(self, joints: Joints, *, by: str) -> None:
        """Record the call."""
        self.calls.append(("confirm_datum", (joints, by)))

    async def guarded_move(self, axis: str, distance: float) -> Jogged:
        """Record the call."""
        self.calls.append(("guarded_move", (axis, distance)))
        return Jogged(axis, distance)

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check and time a path as the real controller does."""
        self.previews += 1
        return self._planner.preview(self.workspace, path, speed)

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Compute the details as the real controller does."""
        return self._planner.inspect(self.workspace, path, speed, samples)

    async def home(self) -> None:
        """Take a minute and stand at the homed pose."""
        self.events.emit(HomingBegun())
        await self._take("home", None, HOMING_TIME)
        self.state = state_of(self._exact(homed_pose(self.config)), closed=self.state.gripper_closed)
        self.events.emit(HomingDone())

    async def move(self, target: Joints, *, speed: float = 1.0) -> None:
        """Take the move's time and stand at its end."""
        assert self.state.joints is not None
        await self._travel("move", [self.state.joints, target], speed)

    async def follow(self, path: Route, *, speed: float = 1.0, on_via: OnVia | None = None) -> None:
        """Take the path's time and stand at its end; `on_via` hears of the vias as they are passed."""
        vias = self.preview(path, speed=speed).vias if on_via is not None else ()
        loop = asyncio.get_running_loop()
        timers = [loop.call_later(passed, on_via, number) for number, passed in enumerate(vias) if on_via is not None]
        try:
            await self._travel("follow", path, speed)
        finally:
            for timer in timers:
                timer.cancel()

    async def jog_speed(self, speed: float) -> bool:
        """Nothing to scale."""
        return False

    async def jog(self, axis: JogDirection, distance: float, *, speed: float = 1.0, clip: bool = False) -> Jogged:
        """Take a second; with `clip` a way of ten centimetres at most is possible, within the limit "fake"."""
        await self._take("jog", (axis, distance, speed, clip), 1.0)
        if clip and abs(distance) > 0.1:
            return Jogged(name_of(axis), 0.1 if distance > 0.0 else -0.1, "fake", "it would come too far")
        return Jogged(name_of(axis), distance)

    async def gripper(self, open_: bool) -> None:
        """Take the settle time."""
        await self._take("gripper", open_, self.config.gripper.settle_time)
        self.state = replace(self.state, gripper_closed=not open_)
        self.events.emit(GripperOpened() if open_ else GripperClosed())

    async def output(self, number: int, *, on: bool) -> None:
        """Switch an output at once."""
        await self._take("output", (number, on), 0.0)
        self.events.emit(OutputSet(number) if on else OutputCleared(number))

    async def input(self, number: int) -> bool:
        """Return the level of an input."""
        return self.inputs[number - 1]

    async def stop(self) -> StopReport:
        """End what is under way with `Stopped`."""
        self.calls.append(("stop", None))
        moving = self._stop is not None
        if self._stop is not None and not self._stop.done():
            self._stop.set_exception(Stopped())
            self._stop.exception()  # a caller cancelled at the same instant does not look at it
        return StopReport(moving, 0.5 if moving else 0.0, (0.0, 0.0, 0.0))

    async def override(self, ratio: float) -> None:
        """Note it, and announce it; the current motion keeps its speed."""
        self.calls.append(("override", ratio))
        self.state = replace(self.state, override=ratio)
        self.events.emit(SpeedChanged(ratio))

    async def pause(self, *, ahead: bool = False) -> StopReport:
        """Note it; the current motion continues."""
        self.calls.append(("pause", ahead))
        return StopReport(self._stop is not None, 0.0, (0.0, 0.0, 0.0))

    async def resume(self) -> None:
        """Note it."""
        self.calls.append(("resume", None))

    async def abort(self) -> None:
        """As stop."""
        await self.stop()

    async def recover(self, *, take_over: bool = False) -> None:
        """Clear the fault."""
        self.calls.append(("recover", None))
        self.state = replace(self.state, mode=Mode.IDLE, fault=None)

    def break_down(self, error: MayaError) -> None:
        """Stand in a fault."""
        self.state = replace(self.state, mode=Mode.FAULT, fault=Notice(error.code, str(error)))

    def _exact(self, joints: Joints) -> Joints:
        return self.units.to_joints(self.units.to_counts(joints))

    async def _travel(self, name: str, path: Route, speed: float) -> None:
        preview = self.preview(path, speed=speed)
        shown = path if isinstance(path, Path) else tuple(path)
        await self._take(name, shown, preview.duration / self.state.override)
        self.state = replace(state_of(preview.end, closed=self.state.gripper_closed), override=self.state.override)

    async def _take(self, name: str, argument: object, duration: float) -> None:
        """Record a call and let its time pass; ends early by `stop`, by its failure, or by cancellation."""
        if self._stop is not None:
            raise Busy(doing=self.calls[-1][0])
        self.calls.append((name, argument))
        failure = self.fail_at.get(len(self.calls))
        self._stop = asyncio.get_running_loop().create_future()
        try:
            await asyncio.wait({self._stop}, timeout=duration * (0.5 if failure else 1.0))
            if self._stop.done():
                self._stop.result()
            if failure is not None:
                raise failure
        except asyncio.CancelledError:
            await elapse(0.5)
            self.calls.append(("at rest", None))
            raise
        finally:
            self._stop = None
