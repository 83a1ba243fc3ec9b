"""The interface of the controller layer, the inspection of a motion, and a motion under way.

Inspection: what is known of a motion before it starts: its positions over time, its closest approaches, its stops.

A coordinated motion under way, and its commanded speed: its prediction follows every change of speed.

The interface serves the layers above: in one process the controller implements it, across a ROS graph a client does.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Protocol

import numpy as np

from dmc41x3.i18n import phrase
from dmc41x3.language.numbers import SCALE, fixed
from maya_un.config import Config
from maya_un.controller.datum import GivenDatum
from maya_un.errors import InvalidValue
from maya_un.events import EventLog
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Zone
from maya_un.motion.clearance import ClosestApproach, closest
from maya_un.motion.move import CoordinatedMove, LongestStop, Trajectory, sample, stopping
from maya_un.motion.path import Route
from maya_un.schema.robot import Jogged, LinkView, Signals
from maya_un.values import LEAST_OVERRIDE, JogDirection, Joints, MarginUnit, Progress, State, StopReport


@dataclass(frozen=True, slots=True)
class Closest:
    """How near a motion comes to a limit or, with `zone`, to a zone of that `name`, and when [s].

    `margin` is in `unit`: "rad", "m", or "load" for the tension of a line; negative is beyond.
    """

    name: str
    margin: float
    unit: MarginUnit
    zone: bool
    time: float


@dataclass(frozen=True, slots=True)
class Inspection:
    """A motion in detail: `trajectory` are samples of it, `closest` its least margins, `stopping` its longest stop."""

    trajectory: Trajectory
    closest: tuple[Closest, ...]
    stopping: LongestStop


def inspect(workspace: Workspace, knots: Floats, move: CoordinatedMove, samples: int) -> Inspection:
    """Return the details of a move through `knots` (n, 3) [rad, m, m], with `samples` samples of its trajectory."""
    return Inspection(
        sample(move, samples),
        tuple(_timed(approach, knots, move) for approach in closest(workspace, knots)),
        stopping(move, workspace.mechanism),
    )


def _timed(approach: ClosestApproach, knots: Floats, move: CoordinatedMove) -> Closest:
    chord, share = approach.place
    steps = np.diff(knots[: chord + 2], axis=0) * np.array(move.units.per_unit)
    lengths = np.sqrt(np.sum(steps * steps, axis=1))
    way = float(np.sum(lengths[:chord]) + share * lengths[chord])
    return Closest(approach.name, approach.margin, approach.unit, approach.zone, move.profile.when(way))


OnVia = Callable[[int], None]
"""Called with the number of every via as the robot passes it, from 0."""

PLACES = 4
"""Decimal places of a speed ratio (Galil DMC-41x3, command VR)."""

_ROUNDING = 1e-6
"""A via due within this time [s] is passed."""


class MotionPace:
    """The commanded speed: the speed override (above 0 up to 1), and whether all motion is on hold.

    The override has the four decimal places that the controller prints; the controller stores it in steps of 1/65536.
    `share` is a further factor, that of a jog under way. `news` completes at the next change.
    """

    def __init__(self) -> None:
        self.override = 1.0
        self.share = 1.0
        self.paused = False
        self.news: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    @property
    def factor(self) -> float:
        """Override times share, as the controller stores it."""
        return fixed(round(self.override * self.share, PLACES)) / SCALE

    @property
    def ratio(self) -> float:
        """The commanded speed ratio of the controller (VR): 0 in a pause, else the factor."""
        return 0.0 if self.paused else self.factor

    def change(self, *, override: float | None = None, paused: bool | None = None, share: float | None = None) -> None:
        """Set the commanded speed and wake all waiting tasks."""
        self.share = self.share if share is None else share
        self.override = self.override if override is None else round(override, PLACES)
        self.paused = self.paused if paused is None else paused
        self.news.set_result(None)
        self.news = asyncio.get_running_loop().create_future()


class MotionRun:
    """A motion that began at loop time `began` [s] and follows `move`, whose profile is the current prediction.

    `members` are its axes (0 to 2), `factor` the override at its beginning. `vias` are ways along its path [counts], in
    order; `on_via` is called with the number of each as it is passed. Times are loop times. A change of speed counts
    from when it was sent, which is early by the latency of the link.
    """

    def __init__(
        self,
        move: CoordinatedMove,
        began: float,
        members: tuple[int, ...],
        factor: float = 1.0,
        *,
        vias: tuple[float, ...] = (),
        on_via: OnVia | None = None,
    ) -> None:
        self.move = move
        self.began = began
        self.acknowledged = began
        """When the controller's answer to `BGS` came: the motion began before that, however slow the link was."""
        self.members = members
        self._factor = factor
        self._paused = False
        self._stood = 0.0
        self._rests_at = inf
        self._vias = vias if on_via is not None else ()
        self._on_via = on_via
        self._passed = 0
        if factor != 1.0:
            self._drive(0.0, factor)

    @property
    def end(self) -> float:
        """Loop time at which the axes will rest at their end [s]; infinite in a pause."""
        return self.began + self.move.duration

    @property
    def rest(self) -> float:
        """Loop time at which the axes come to rest [s]: in a pause if that holds them, else at the end."""
        return min(self.end, self.began + self._rests_at)

    def follow(self, pace: MotionPace, now: float) -> None:
        """Update the prediction from loop time `now` [s] on, for the commanded ratio."""
        t = now - self.began
        if self._paused and not pace.paused:
            self._stood += max(0.0, t - self._rests_at)
            self._rests_at = inf
        if pace.paused and not self._paused:
            self._drive(t, 0.0)
            if self.move.duration == inf:
                self._rests_at = self.move.profile.pieces[-1].t
        elif not pace.paused:
            self._drive(t, pace.factor)
        self._paused, self._factor = pace.paused, pace.factor

    def times(self, now: float) -> tuple[float, float]:
        """Return the elapsed and the whole time of motion [s]; time at rest in a pause does not count."""
        moved = min(now - self.began, self._rests_at)
        whole = self.move.duration
        if whole == inf:
            whole = self.move.profile.changed(self._rests_at, self._factor).duration
        return moved - self._stood, whole - self._stood

    def stop_report(self, now: float) -> StopReport:
        """Return the report of a stop at loop time `now` [s]."""
        elapsed = now - self.began
        duration, end = self.move.stop_at(elapsed)
        here = self.move.position_at(elapsed)
        return StopReport(duration > 0.0, duration, _minus(end, here))

    def next_via(self) -> float:
        """Return the loop time at which the next via is passed [s]; infinite if none is left or a pause prevents it."""
        if self._passed >= len(self._vias):
            return inf
        return self.began + self.move.profile.when(self._vias[self._passed])

    def tell_vias(self, now: float) -> None:
        """Call `on_via` for the vias that are passed by loop time `now` [s], in order, each once."""
        while self._on_via is not None and self._passed < len(self._vias) and self.next_via() <= now + _ROUNDING:
            self._passed += 1
            self._on_via(self._passed - 1)

    def _drive(self, t: float, ratio: float) -> None:
        self.move = replace(self.move, profile=self.move.profile.changed(t, ratio))


HOMING_PHASES = ("raise", "datum_a", "datum_c", "datum_b", "stroke_c", "stroke_b", "pose")
"""The phases of a homing, in their order."""


def homing_progress(phase: str, elapsed: float) -> Progress:
    """Return the progress of a homing whose `phase` began `elapsed` [s] ago; "" before the first phase."""
    return Progress(
        phase, elapsed, 0.0, HOMING_PHASES.index(phase) + 1 if phase in HOMING_PHASES else 0, len(HOMING_PHASES)
    )


def _minus(one: Joints, two: Joints) -> tuple[float, float, float]:
    return one.a - two.a, one.b - two.b, one.c - two.c


@dataclass(frozen=True, slots=True)
class Preview:
    """Preview of a motion, known before it starts.

    `duration` [s]; `lowest` and `highest` gripper point on the way [m]; `end` the joints it ends at (whole
    counts, in rad and m); `vias` when each waypoint between the ends is passed [s].
    """

    duration: float
    lowest: float
    highest: float
    end: Joints
    vias: tuple[float, ...] = ()


class Controller(Protocol):
    """Joint-space control of Maya: one command at a time, every path checked as a whole, stop always possible.

    Motion raises `NotConnected`, `Faulted`, `NotHomed`, `Busy`, `Unreachable` or `PathRefused` before anything is sent;
    `Stopped` after a stop; a `MachineError` if the machine behaves unexpectedly. Cancelling the awaiting task stops on
    the path and ends when the axes are at rest.
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
        """The workspace; its strokes are the measured ones once the robot is homed."""
        ...

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The zones that the robot avoids: those of the configuration, until `set_zones` replaces them."""
        ...

    def set_zones(self, zones: Sequence[Zone]) -> None:
        """Replace the zones that the robot avoids, while this program runs; raises `Busy` while something moves."""
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

    def signals(self) -> Signals | None:
        """Return signals of the controller; None while disconnected, and where only another process has them."""
        ...

    async def interrogate(self, command: str) -> str:
        """Return the answer of the motion controller to a command of its language that only reads; it may have lines.

        Raises `TerminalReadsOnly` for any other text, `CommandRejected`, `NotConnected`, and the loss of the link.
        """
        ...

    def link(self, speed: float) -> LinkView:
        """Return the quality of the link, in real time; the loop's clock runs at `speed` times real time."""
        ...

    @property
    def run(self) -> MotionRun | None:
        """The motion under way; None at rest, in a homing, and where another process carries motions out."""
        ...

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check `path` (joints in rad, m, m) as a motion would and return its preview; sends nothing."""
        ...

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`, None if the path has no length; raises as `preview` does."""
        ...

    async def home(self) -> None:
        """Find the switches, define the counts, measure the strokes."""
        ...

    @property
    def datum(self) -> GivenDatum | None:
        """The datum that a person gave, None without one, and where only another process has it."""
        ...

    async def give_datum(self, joints: Joints, *, by: str) -> None:
        """Accept the statement of the person `by` that the robot stands at `joints` (rad, m, m); moves nothing.

        Raises `Unreachable`, `Busy`, `NotConnected`, `Faulted`, ownership and configuration errors.
        """
        ...

    async def confirm_datum(self, joints: Joints, *, by: str) -> None:
        """Compare the position with a second point that `by` states (rad, m, m); moves nothing.

        Raises `DatumRefused`, and `DatumContradicted`, after which the robot is not homed.
        """
        ...

    async def guarded_move(self, axis: str, distance: float) -> Jogged:
        """Slowly move one axis of a robot that is not homed by `distance` (rad or m); return the distance moved."""
        ...

    async def move(self, target: Joints, *, speed: float = 1.0) -> None:
        """Go to `target` (rad, m, m) on a straight line in joint space; `speed` 0 to 1 of the limits."""
        ...

    async def follow(self, path: Route, *, speed: float = 1.0, on_via: OnVia | None = None) -> None:
        """Move along `path`; raises `TrajectoryRefused` unless it starts at the robot's position.

        Calls `on_via` with the number of every waypoint between the ends, from 0, as it is passed; in order, each once,
        before this returns, and none after a stop.
        """
        ...

    async def jog(self, axis: JogDirection, distance: float, *, speed: float = 1.0, clip: bool = False) -> Jogged:
        """Move along one axis by `distance` (rad or m) and return the distance moved; the gripper's axes go straight.

        Axes are a, b, c, and x, y, z and r of the gripper, r outward along the boom; a unit vector is one too. With
        `clip` the robot goes as far as the workspace allows and comes to rest before the limit; without, a longer
        distance raises an error.
        """
        ...

    async def jog_speed(self, speed: float) -> bool:
        """Scale the speed of the jog along a vector under way, from 0.01 to 1 of the full speed, at once.

        Return False if this is impossible: no such jog is under way here.
        """
        ...

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper and wait until it has moved; in a pause, first wait for its end."""
        ...

    async def output(self, number: int, *, on: bool) -> None:
        """Switch a digital output that `controller.outputs` lists (Galil SB, CB); in a pause, wait for its end first.

        Raises `InvalidValue` for others.
        """
        ...

    async def input(self, number: int) -> bool:
        """Return whether digital input `number`, from 1 to 8, is high; raises `NotConnected`."""
        ...

    async def stop(self) -> StopReport:
        """Begin to brake at once, on the path, past every queue; return the duration and distance of braking."""
        ...

    async def override(self, ratio: float) -> None:
        """Scale the speed of the motion under way and of all later ones by `ratio`, from 0.01 to 1."""
        ...

    async def pause(self, *, ahead: bool = False) -> StopReport:
        """Brake on the path and hold all motion until `resume`; return the duration and distance of braking.

        Raises `CannotPause` for a homing or a guarded move, and if nothing is under way, unless `ahead`.
        """
        ...

    async def resume(self) -> None:
        """Continue motion after a pause; raises `NotPaused`."""
        ...

    async def abort(self) -> None:
        """Stop without deceleration."""
        ...

    async def recover(self, *, take_over: bool = False) -> None:
        """Clear a fault whose cause is gone; moves nothing.

        With `take_over`, claims the controller from another program that owns it, at rest.
        """
        ...


def require_ratio(key: str, ratio: float) -> None:
    """Raise `InvalidValue` for a factor on the speed of a motion under way that is not from `LEAST_OVERRIDE` to 1."""
    if not LEAST_OVERRIDE <= ratio <= 1.0:
        raise InvalidValue(
            key=key, value=ratio, reason=phrase("it is at least {least:g} and at most 1", least=LEAST_OVERRIDE)
        )


def require_output(config: Config, number: int) -> None:
    """Raise `InvalidValue` for an output that primitives may not switch."""
    if number not in config.controller.outputs:
        raise InvalidValue(key="output", value=number, reason="`controller.outputs` of the configuration lacks it")
