"""Direct commands, which bypass the queue: one at a time, including held jogs.

A held jog is one planned motion to the border of the workspace, so it is bounded and decelerates before the border.
Along a vector its speed may change at once. Another direction is another motion, which begins when the first one is at
rest. A stick is never quite still, so a direction that differs by less than `TURN` is the same.
After its end by the border it does not start again in its direction until the key is released. After another user's
stop or a fault, the press moves nothing any more, in no direction and at no speed, until the key is released or not
renewed. Two connections may exchange the order of two requests: a client that numbers the presses of its keys moves
nothing by a request that arrives after the end of its press.

The queue waits: a job starts when the direct command has ended, or the held key is released and the robot rests. If
the key was not renewed or the command was stopped, the queue pauses instead. A command is refused with `Busy` while a
job or another command is running. Callers have passed the gate by `Operation.COMMAND`.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine
from contextlib import ExitStack, suppress
from math import cos, hypot
from typing import Any, NamedTuple, TypeVar

from dmc41x3.i18n import phrase
from maya_un.cancellation import cancel_once, is_caller_cancelled, run_to_rest
from maya_un.controller.planner import LONGEST
from maya_un.controller.protocol import Controller, OnVia
from maya_un.errors import Busy, Cancelled, Faulted, InvalidValue, MachineError, MayaError, NotConnected, Stopped
from maya_un.motion.path import Route
from maya_un.process.process import Process
from maya_un.process.queue.scheduler import Scheduler
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import OnPhase, Robot
from maya_un.schema.jobs import PauseReason
from maya_un.schema.robot import HeldJog, Jogged, SteeredJog
from maya_un.service.access.operations import Caller
from maya_un.values import LEAST_OVERRIDE, JogDirection, Joints, Mode

T = TypeVar("T")

PATIENCE = 0.5
"""A held jog that is not renewed within this time stops [s]."""

_MOST_PRESSES = 64
"""Number of ended presses that are remembered."""

_REFUSED_WITHIN = 0.05
_ANSWERED_WITHIN = 0.5
"""Part of a held jog's patience after which a request is answered though the previous jog still brakes."""
_ROUNDING = 1e-6


TURN = 0.2
"""A held jog along a vector goes on in its direction while the wanted one differs by less than this angle [rad]."""

_FINEST = 0.02
"""Smaller changes of the speed are left out [share of the full speed]."""


class _Key(NamedTuple):
    """The held key: an axis with its direction, or a stick with its unit `vector`."""

    axis: str
    direction: int
    speed: float
    vector: tuple[float, float, float] | None = None

    @classmethod
    def steered(cls, vector: tuple[float, float, float]) -> _Key:
        """Return the key for a vector whose length is the speed; raises `InvalidValue`."""
        length = hypot(*vector)
        if not LEAST_OVERRIDE <= length <= 1.0 + _ROUNDING:
            raise InvalidValue(
                key="vector",
                value=repr(vector),
                reason=phrase("its length must be {least:g} to 1; to stop, send `hold` false", least=LEAST_OVERRIDE),
            )
        x, y, z = vector
        return cls("", 1, min(1.0, length), (x / length, y / length, z / length))

    def is_like(self, other: _Key | None) -> bool:
        """Return whether the jog of another key need not stop for this one."""
        if self.vector is None or other is None or other.vector is None:
            return self == other
        return sum(one * another for one, another in zip(self.vector, other.vector, strict=True)) > cos(TURN)

    @property
    def along(self) -> JogDirection:
        """The direction for the controller."""
        return self.axis if self.vector is None else self.vector


class _Outcome(NamedTuple):
    """The state of the jog of a key, as in `HeldJog`."""

    key: _Key
    moving: bool
    limit: str = ""
    reason: str = ""


_ENDS_PRESS = (Stopped, Faulted, NotConnected, MachineError)
"""Errors of a jog after which its press moves nothing any more."""


class HeldJogs:
    """At most one held jog of a controller; it continues while it is renewed within `patience` [s, loop time].

    `scheduler` begins no job from the first motion of a press until the press is over and the robot rests. If a press
    ends because it is not renewed, the queue pauses.
    """

    def __init__(self, controller: Controller, patience: float = PATIENCE, scheduler: Scheduler | None = None) -> None:
        self._controller = controller
        self._patience = patience
        self._scheduler = scheduler
        self._aside = ExitStack()
        self._is_aside = False
        self._key: _Key | None = None
        self._halted = False
        self._until = 0.0
        self._task: asyncio.Task[Jogged] | None = None
        self._moved: _Key | None = None
        self._stops_at_press = 0
        self._stops_at_jog = 0
        self._watch: asyncio.TimerHandle | None = None
        self._turn = asyncio.Lock()
        self._beginning: set[asyncio.Task[None]] = set()
        self._press: str | None = None
        self._ended: deque[str] = deque(maxlen=_MOST_PRESSES)

    async def hold(self, axis: str, direction: int, speed: float, press: str | None = None) -> HeldJog:
        """Start a held jog, or renew it; for another axis, direction or speed, the previous jog first comes to rest.

        A `press` that has ended, for whatever reason, moves nothing any more. Returns as soon as it moves, and earlier
        if the previous jog brakes for long: the client must renew the key meanwhile. Raises the errors of a motion, and
        `InvalidValue` for a direction other than 1 and -1.
        """
        if direction not in (1, -1):
            raise InvalidValue(key="direction", value=direction, reason="it must be 1 or -1")
        found = await self._hold(_Key(axis, direction, speed), press)
        return HeldJog(axis, direction, found.moving, found.limit, found.reason)

    async def steer(self, vector: tuple[float, float, float], press: str | None = None) -> SteeredJog:
        """Start or renew a held jog along `vector`, whose length (0.01 to 1) is the share of the full speed.

        The speed changes at once. For another direction, the previous jog first comes to rest. Raises as `hold`, and
        `InvalidValue` for another length.
        """
        found = await self._hold(_Key.steered(vector), press)
        x, y, z = found.key.vector or vector
        speed = found.key.speed
        return SteeredJog((speed * x, speed * y, speed * z), found.moving, found.limit, found.reason)

    async def _hold(self, key: _Key, press: str | None) -> _Outcome:
        if press in self._ended:
            return _Outcome(key, moving=False)
        if press != self._press:
            self._end_press()
            self._press = press
        held = self._key
        if held is None:
            self._halted, self._stops_at_press = False, self._controller.stops
        elif self._is_over():
            self._renew()
            return self._answer(self._moved or key)._replace(key=key)
        elif key.is_like(held):
            if await self._goes_on(held, key.speed):
                return self._answer(held._replace(speed=key.speed))
            if self._key is None or press != self._press:  # released meanwhile
                return _Outcome(key, moving=False)
        self._brake()
        self._key = key
        self._renew()
        await self._begin_in_time(key, press)
        return self._answer(key)

    async def release(self, press: str | None = None) -> None:
        """End the held jog: stop on the path and return at rest; do nothing without a held jog.

        With a `press`, end that press alone, and do nothing to the jog of another one.
        """
        if press is not None and press != self._press:
            self._remember(press)
            return
        self._end_press()
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None
        self._brake()
        if self._task is not None:
            await asyncio.wait({self._task, *self._beginning})
        self._let_jobs_begin()

    def halt(self) -> None:
        """Start braking on the path; a key that is still held starts no new jog until it is released."""
        self._halted = True
        self._brake()
        self._let_jobs_begin()

    def _is_over(self) -> bool:
        """Return whether the robot was stopped, or a fault came, since the held press began."""
        rests = self._task is None or self._task.done()
        if self._key is not None and rests and self._controller.stops != self._stops_at_press:
            self._halted = True
        elif self._moved is not None and self._task is not None and not self._halted:
            failed = rests and not self._task.cancelled() and isinstance(self._task.exception(), _ENDS_PRESS)
            self._halted = failed or self._controller.state.mode in (Mode.FAULT, Mode.DISCONNECTED)
        return self._halted

    def _end_press(self) -> None:
        if self._press is not None:
            self._remember(self._press)
        self._press = self._key = self._moved = None

    def _remember(self, press: str) -> None:
        if press not in self._ended:
            self._ended.append(press)

    async def _jog(self, key: _Key) -> Jogged:
        """Jog to the border of the workspace while no job begins; raises `Busy` while one runs."""
        if self._scheduler is not None and not self._is_aside:
            self._aside.enter_context(self._scheduler.aside("jog"))
            self._is_aside = True
        self._stops_at_jog = self._controller.stops
        try:
            return await self._controller.jog(key.along, key.direction * LONGEST, speed=key.speed, clip=True)
        except (Stopped, asyncio.CancelledError) as end:
            if not isinstance(end, Stopped) and not self._was_stopped():
                raise
            self._pause_jobs(PauseReason.STOP)
            raise Stopped from None  # also if the stop came while the jog braked for another key

    def _was_stopped(self) -> bool:
        """Return whether the robot was stopped since the latest jog began."""
        return self._controller.stops != self._stops_at_jog

    def _pause_jobs(self, reason: PauseReason) -> None:
        if self._scheduler is not None:
            self._scheduler.pause_by_itself(reason)

    def _let_jobs_begin(self) -> None:
        """Let jobs begin again, unless a press goes on or the robot still moves for one."""
        if self._is_aside and (self._key is None or self._is_over()) and (self._task is None or self._task.done()):
            if self._was_stopped():
                self._pause_jobs(PauseReason.STOP)
            self._is_aside = False
            self._aside.close()

    def _brake(self) -> None:
        if self._task is not None and not self._task.done() and not self._task.cancelling():
            self._task.cancel()

    async def _begin_in_time(self, key: _Key, press: str | None) -> None:
        """Begin the jog; return early if the previous one brakes for long, so that the client can renew its key."""
        for older in self._beginning:
            older.cancel()
        beginning = asyncio.get_running_loop().create_task(self._begin(key, press))
        self._beginning.add(beginning)
        beginning.add_done_callback(self._beginning.discard)
        try:
            await asyncio.wait({beginning}, timeout=self._patience * _ANSWERED_WITHIN)
        except asyncio.CancelledError:
            beginning.cancel()
            raise

    async def _begin(self, key: _Key, press: str | None) -> None:
        """Start the jog when the previous one is at rest, unless the press is over or the key changed."""
        async with self._turn:
            if self._task is not None:
                await asyncio.wait({self._task})
            wanted = self._key  # its speed may be newer
            if self._is_over() or press != self._press or wanted is None or not key.is_like(wanted):
                return
            if asyncio.get_running_loop().time() > self._until:
                return
            self._task = asyncio.get_running_loop().create_task(self._jog(wanted), name="held jog")
            self._task.add_done_callback(_retrieved)
            self._task.add_done_callback(lambda _: self._let_jobs_begin())
            self._moved = key
            # A refusal is raised before any waiting for motion.
            await asyncio.wait({self._task}, timeout=_REFUSED_WITHIN)
            if press == self._press and key.is_like(self._key):
                self._renew()

    async def _goes_on(self, key: _Key, speed: float) -> bool:
        """Continue the jog of the held `key` at `speed`; return False if it must begin again for that."""
        self._renew()
        if abs(speed - key.speed) < _FINEST:
            return True
        self._key = key._replace(speed=speed)
        moving = self._task is not None and not self._task.done() and not self._task.cancelling()
        return not moving or not key.is_like(self._moved) or await self._controller.jog_speed(speed)

    def _answer(self, key: _Key) -> _Outcome:
        """Return the state of a key's jog; raises the error that ended it, unless the border did."""
        task = self._task
        if task is None or not key.is_like(self._moved) or task.cancelling() or task.cancelled():
            return _Outcome(key, moving=False)
        if not task.done():
            return _Outcome(key, moving=True)
        gone = task.result()
        return _Outcome(key, moving=False, limit=gone.limit, reason=gone.reason)

    def _renew(self) -> None:
        loop = asyncio.get_running_loop()
        self._until = loop.time() + self._patience
        if self._watch is None:
            self._watch = loop.call_at(self._until, self._expired)

    def _expired(self) -> None:
        """Stop a jog that was not renewed, or set the timer again."""
        loop = asyncio.get_running_loop()
        self._watch = None
        if loop.time() < self._until - _ROUNDING:
            self._watch = loop.call_at(self._until, self._expired)
        else:
            if self._is_aside:
                self._pause_jobs(PauseReason.DRIVER)  # the user may no longer watch
            self._end_press()
            self._brake()
            self._let_jobs_begin()


def _retrieved(task: asyncio.Task[Jogged]) -> None:
    """Retrieve the error of a jog; a renewal raises a `MayaError`, other errors go to the loop's exception handler."""
    if not task.cancelled() and not isinstance(task.exception(), MayaError | None):
        task.get_loop().call_exception_handler({"message": "a held jog failed", "exception": task.exception()})


class DirectCommands:
    """Carries out direct commands, which bypass the queue of `process`; `halt_jogs` stops held jogs.

    Every command raises the errors of its layer. Cancelling it stops on the path.
    """

    def __init__(self, process: Process, robot: Robot, controller: Controller, halt_jogs: Callable[[], None]) -> None:
        self._process = process
        self._robot = robot
        self._controller = controller
        self._halt_jogs = halt_jogs
        self._doing = ""
        self._task: asyncio.Task[Any] | None = None

    @property
    def doing(self) -> str:
        """The running command, or ""."""
        return self._doing

    def require_free(self) -> None:
        """Raise `Busy` while a direct command is running."""
        if self._doing:
            raise Busy(doing=self._doing)

    async def home(self) -> None:
        """Home: find the switches, define the counts, measure the strokes."""
        await self._do("home", self._controller.home())

    async def give_datum(self, joints: Joints, by: Caller) -> None:
        """Believe a person that the robot stands at `joints` (rad, m, m)."""
        await self._do("datum", self._controller.give_datum(joints, by=by.name))

    async def confirm_datum(self, joints: Joints, by: Caller) -> None:
        """Compare the position with the second point that a person states (rad, m, m)."""
        await self._do("datum", self._controller.confirm_datum(joints, by=by.name))

    async def guarded_move(self, axis: str, distance: float) -> Jogged:
        """Move one axis of a robot that is not homed by `distance` (rad or m, at most `datum.NUDGE`).

        Return the distance moved. Raises `InvalidValue`, `DatumRefused`, `HomingStalled`, and the errors of a motion.
        """
        return await self._do("guarded move", self._controller.guarded_move(axis, distance))

    async def move(self, target: Joints) -> None:
        """Go to `target` (rad, m, m), in a straight line in joint space."""
        await self._do("move", self._controller.move(target))

    async def follow(self, path: Route, *, speed: float = 1.0, on_via: OnVia | None = None) -> None:
        """Go along `path`, whose first point is the current position."""
        await self._do("follow", self._controller.follow(path, speed=speed, on_via=on_via))

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper."""
        await self._do("gripper", self._controller.gripper(open_))

    async def output(self, number: int, *, on: bool) -> None:
        """Switch a digital output of the controller."""
        await self._do("output", self._controller.output(number, on=on))

    async def primitive(self, primitive: Primitive, on_phase: OnPhase | None = None) -> None:
        """Carry out a primitive; `on_phase` is called for each phase."""
        await self._do(primitive.command, self._robot.run(primitive, on_phase))

    async def end_all(self) -> None:
        """Cancel every movement (of a job, a direct command, a homing or a jog) and all waiting jobs.

        Braking starts at once; this returns when the robot is at rest and the queue is empty. A job that was
        interrupted by an earlier end of the program still waits for a decision. Raises `StorageFailed`.
        """
        self._process.end_running()
        self._halt_jogs()
        cancel_once(self._task)
        try:
            with suppress(NotConnected):
                await self._controller.stop()
        finally:
            await self._process.end_all()
        if self._task is not None:
            await asyncio.wait({self._task})

    async def _do(self, name: str, work: Coroutine[Any, Any, T]) -> T:
        try:
            self.require_free()
            with self._process.scheduler.aside(name):
                return await self._carried(name, work)
        finally:
            work.close()

    async def _carried(self, name: str, work: Coroutine[Any, Any, T]) -> T:
        """Carry out a command in a separate task; the caller returns when it has ended, cancelled or not."""
        self._doing = name
        begun = self._begun(work, self._controller.stops)
        self._task = task = asyncio.get_running_loop().create_task(begun, name=f"direct {name}")
        try:
            return await run_to_rest(task)
        except asyncio.CancelledError:
            if is_caller_cancelled():
                raise
            raise Cancelled from None
        finally:
            self._doing, self._task = "", None

    async def _begun(self, work: Coroutine[Any, Any, T], stops: int) -> T:
        """Begin a command, unless the robot was stopped since it came: its task begins a turn of the loop later."""
        if stops != self._controller.stops:
            raise Stopped
        return await work
