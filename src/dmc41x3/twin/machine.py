"""A DMC-4133 without a network: it receives bytes of a connection and returns its reply, at a time set by the caller.

The machine never waits and never reads a clock. It accepts any bytes and never raises because of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from math import inf

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.commands import system
from dmc41x3.twin.context import CallerContext, OperandScope, record
from dmc41x3.twin.execution import execute
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.memory import Memory
from dmc41x3.twin.network import Attempt, Handle, HandleProtocol
from dmc41x3.twin.plant import Plant
from dmc41x3.twin.runner import ProgramRunner
from dmc41x3.twin.unit import Activity, ControllerIdentity, Unit

REVISION = "Rev 1.3k"
"""Revision of the default firmware line."""

PORT = 23
SERIAL = 41330
ADDRESS = (10, 51, 0, 87)
HARDWARE_ADDRESS = "00-50-4C-08-01-1F"
_ECHOED = re.compile(rb"[^\r;]*[\r;]|[^\r;]+")
"""The pieces of received bytes that a serial port echoes before it executes them."""

HORIZON = 1.0
"""How far ahead the machine predicts events of axes that a program watches [s]."""


class VirtualDmc:
    """The controller.

    `plant` is driven by its motors, `axes` is their number (1 to 8), `motors_off` whether motors that were never burned
    power up off, `memory` the burned state. `firmware` is the line of ^R^V, by default that of a DMC-41x3. While `balk`
    returns true, commands are refused with code 1 and not executed (for faults on demand). Times are seconds on one
    clock of the caller that never goes back.
    """

    def __init__(
        self,
        plant: Plant,
        *,
        axes: int = 3,
        firmware: str | None = None,
        serial: int = SERIAL,
        motors_off: bool = True,
        memory: Memory | None = None,
    ) -> None:
        if not 1 <= axes <= 8:
            raise ValueError("a DMC-41x3 has one to eight axes")
        line = firmware or f"DMC41{axes}3 {REVISION}"
        self._unit = Unit(plant, axes, ControllerIdentity(line, serial, ADDRESS, HARDWARE_ADDRESS), motors_off, memory)
        self._unit.records.source = partial(record, self._unit)
        self._runner = ProgramRunner(self._unit)
        self._unit.activities = (self._runner, *self._unit.activities, self._unit.records)
        self.balk: Callable[[], bool] | None = None
        self._core = self._unit.core
        self._plant = plant
        self._contexts: dict[Handle, CallerContext] = {}
        self._activities: tuple[Activity, ...] = self._unit.activities
        self._others = tuple(activity for activity in self._activities if activity is not self._runner)
        self._active: list[Activity] = []
        self._event = self._event_of_others = inf
        self._idle = False
        system.power_up(self._unit)
        self._look()

    @property
    def now(self) -> float:
        """The time to which the controller has advanced [s]."""
        return self._core.now

    @property
    def unit(self) -> Unit:
        """The state of the controller, for external readers such as tests."""
        return self._unit

    def connect(
        self, peer: tuple[str, int] = ("127.0.0.1", 0), kind: HandleProtocol = HandleProtocol.TCP, port: int = PORT
    ) -> Handle | None:
        """Assign the first free handle to a new connection to `port`; None if all are in use or IK blocks the port."""
        handle = self._unit.handles.connect(peer, kind, port)
        if handle is not None:
            self._contexts[handle] = CallerContext(self._unit, OperandScope(self._unit, handle), handle)
        return handle

    def plug(self) -> Handle:
        """Connect a cable to the main serial port; the commands of this handle are echoed with EO 1."""
        handle = self._unit.handles.plug()
        self._contexts[handle] = CallerContext(self._unit, OperandScope(self._unit, handle), handle)
        return handle

    def disconnect(self, handle: Handle) -> None:
        """Free the handle of an ended connection; motion continues. Idempotent."""
        self._unit.handles.close(handle)
        self._contexts.pop(handle, None)

    def receive(self, handle: Handle, data: bytes, now: float) -> bytes:
        """Execute the commands that `data` completes, at time `now` [s], and return their replies.

        A command may close handles, also the sender's: check `Handle.open` afterwards.
        """
        self.advance(now)
        if handle.master:
            _take_answer(handle, data)
            return b""
        replies: list[bytes] = []
        if handle.kind is HandleProtocol.SERIAL:
            for piece in _ECHOED.findall(data):  # an echo stops within the data of the EO 0
                if self._unit.echo:
                    replies.append(piece.replace(b"\r", b"\r\n"))
                replies.extend(self._replies(handle, piece))
        else:
            replies.extend(self._replies(handle, data))
        self._look()
        return b"".join(replies)

    def _replies(self, handle: Handle, data: bytes) -> Iterator[bytes]:
        """Execute the commands that `data` completes and yield the reply of each."""
        for text in handle.splitter.split(data):
            context = self._contexts.get(handle)
            if context is None or not handle.open:
                continue  # the splitter must be exhausted
            yield self._take_in(handle, text) if handle.download else self._reply(context, text)

    def advance(self, now: float) -> None:
        """Advance the controller and its plant to time `now` [s].

        If nothing moves and nothing is due before `now`, this is a single step.
        """
        core = self._core
        while core.now < now:
            if self._event <= now and self._runner.hurries:
                self._runner.hurry(self._quiet_until(now))
                self._event = min(self._runner.next_event(), self._event_of_others)
            if self._event > now and self._idle and self._plant.next_event(now) is None:
                core.coast(now)
                return
            core.step(min(now, self._event))
            self._look()

    def next_event(self, until: float) -> float | None:
        """Return the time of the next event in (now, until] [s], None if there is none."""
        event = self._core.next_event(min(self._event, until))
        return event if event is not None else self._event if self._event <= until else None

    def wake(self) -> float:
        """Return when to advance the controller next if no data arrive [s], infinity for never.

        It may then have something to send.
        """
        wake = min(self._runner.wake(), self._event_of_others)
        if self._idle:
            return wake
        moving = any(axis.moving for axis in self._unit.axes)
        if moving and any(activity.watching for activity in self._activities):
            horizon = self._core.now + HORIZON
            event = self._core.next_event(min(wake, horizon))
            wake = min(wake, horizon if event is None else event)
        return wake

    def look(self) -> None:
        """Handle an external change (of inputs, of the plant) at the present time."""
        self._core.look()
        self._look()

    def power_off(self) -> None:
        """Lose power at the present time: motors and outputs switch off; connections and unburned data are lost."""
        self._unit.reset()
        for activity in self._activities:
            activity.reset()
        self._unit.handles.reset()
        self._plan()

    def power_on(self) -> None:
        """Power up with the burned state, at the present time."""
        system.reset(self._unit)
        self._look()

    def take_messages(self) -> list[tuple[Handle, bytes]]:
        """Return the unsolicited bytes by handle, and clear them."""
        return self._unit.outlet.take()

    def abort_input(self, active: bool) -> None:
        """Set the abort input at the present time."""
        self._core.set_abort_input(active)
        self._look()

    def amplifier_fault(self, status: int) -> None:
        """Set the amplifiers' fault bits, laid out as in the data record, at the present time; 0 means no fault."""
        self._core.set_amplifier_status(status & 0xFFFFFFFF)
        self._look()

    def _quiet_until(self, now: float) -> float:
        """Return the time up to `now` [s] before which only the program's threads can act."""
        limit = min(now, self._event_of_others)
        event = self._core.next_event(limit)
        return limit if event is None else event

    def _look(self) -> None:
        now, happened = self._core.now, self._core.happened
        self._runner.look(now)
        happened.clear()
        self._active = [activity for activity in self._others if activity.active]
        for activity in self._active:
            activity.look(now)
        if happened:
            self._runner.look(now)  # a program may have a subroutine for what an activity found
            happened.clear()
        self._plan()

    def _plan(self) -> None:
        """Compute the next event; until the next look, only the plant can have an earlier one."""
        self._event_of_others = min([activity.next_event() for activity in self._active], default=inf)
        self._event = min(self._runner.next_event(), self._event_of_others)
        self._idle = self._core.idle

    def _take_in(self, handle: Handle, text: str) -> bytes:
        """Pass a line to the download under way; the backslash ends the download."""
        download = handle.download
        assert download is not None
        try:
            if text != "\\":
                download.line(text)
                return b""
            handle.download = None
            download.end()
        except Rejection as refused:
            self._unit.error_code = int(refused.code)
            return b"?"
        return b"::"

    def _reply(self, context: CallerContext, text: str) -> bytes:
        if self.balk is not None and self.balk():
            self._unit.error_code = int(ErrorCode.UNRECOGNIZED_COMMAND)
            return b"?"
        try:
            answer = execute(context, text)
        except Rejection as refused:
            self._unit.error_code = int(refused.code)
            return b"?"
        if answer is None:
            handle = context.caller
            if handle is not None and handle.download is not None:
                handle.splitter.program = True
                return b""
            return b":"
        return answer + b":" if isinstance(answer, bytes) else answer.encode("ascii") + b"\r\n:"


def _take_answer(handle: Handle, data: bytes) -> None:
    """Store the answer of the other side of a handle that IH opened; that side does not send commands."""
    for byte in data:
        if byte in b":?":
            handle.attempt = Attempt.ACCEPTED if byte == ord(":") else Attempt.REFUSED
