"""A DMC-4133 without a wire: bytes of a connection in, bytes of its reply out, at a time that the caller tells.

The machine never waits and never looks at a clock. It obeys whatever bytes come and never raises for any of them.
"""

from __future__ import annotations

from collections.abc import Callable
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
"""Firmware it says it has, unless told otherwise."""

PORT = 23
SERIAL = 41330
ADDRESS = (10, 51, 0, 87)
HARDWARE_ADDRESS = "00-50-4C-08-01-1F"
HORIZON = 1.0
"""How far ahead the machine looks for what may befall axes that a program watches [s]."""


class VirtualDmc:
    """The controller.

    `plant` is what its motors drive, `axes` how many there are (1 to 8), `motors_off` whether motors that were never
    burned power up off, `memory` what is burned. `firmware` is the line of ^R^V, by default that of a DMC-41x3.
    While `balk` says so, a command is refused with code 1 and not executed (for faults on demand).
    Times are seconds on one clock of the caller's that never goes back.
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
        """The time advanced to [s]."""
        return self._core.now

    @property
    def unit(self) -> Unit:
        """The memory of the controller, for readers outside of it, such as tests."""
        return self._unit

    def connect(
        self, peer: tuple[str, int] = ("127.0.0.1", 0), kind: HandleProtocol = HandleProtocol.TCP, port: int = PORT
    ) -> Handle | None:
        """Give a new connection to `port` the first free handle; None where all are taken or IK blocks the port."""
        handle = self._unit.handles.connect(peer, kind, port)
        if handle is not None:
            self._contexts[handle] = CallerContext(self._unit, OperandScope(self._unit, handle), handle)
        return handle

    def disconnect(self, handle: Handle) -> None:
        """Take a handle back whose connection ended; motion goes on. Again is harmless."""
        self._unit.handles.close(handle)
        self._contexts.pop(handle, None)

    def receive(self, handle: Handle, data: bytes, now: float) -> bytes:
        """Execute the commands that `data` completes, at time `now` [s], and return their replies.

        A command may close handles, the sender's among them: see `Handle.open` afterwards.
        """
        self.advance(now)
        if handle.master:
            _take_answer(handle, data)
            return b""
        replies: list[bytes] = []
        for text in handle.splitter.split(data):
            context = self._contexts.get(handle)
            if context is None or not handle.open:
                continue  # the splitter is run to its end
            replies.append(self._take_in(handle, text) if handle.download else self._reply(context, text))
        self._look()
        return b"".join(replies)

    def advance(self, now: float) -> None:
        """Bring the controller and its plant to time `now` [s].

        If nothing moves and nothing is due before, this is a single step.
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
        """Return when in (now, until] something happens by itself [s], None where nothing does."""
        event = self._core.next_event(min(self._event, until))
        return event if event is not None else self._event if self._event <= until else None

    def wake(self) -> float:
        """Return when it should next be advanced though nobody talks to it [s], infinity for never.

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
        """See to a change from outside (of inputs, of the plant) at the time last advanced to."""
        self._core.look()
        self._look()

    def power_off(self) -> None:
        """Lose power at the time last advanced to: motors and outputs go off, connections and what is not burned go."""
        self._unit.reset()
        for activity in self._activities:
            activity.reset()
        self._unit.handles.reset()
        self._plan()

    def power_on(self) -> None:
        """Come up again with what is burned, at the time last advanced to."""
        system.reset(self._unit)
        self._look()

    def take_messages(self) -> list[tuple[Handle, bytes]]:
        """Return the bytes for handles that did not ask for them, and forget them."""
        return self._unit.outlet.take()

    def abort_input(self, active: bool) -> None:
        """Set the abort input at the time last advanced to."""
        self._core.set_abort_input(active)
        self._look()

    def amplifier_fault(self, status: int) -> None:
        """Set the amplifiers' fault bits, laid out as in the data record, at the time last advanced to; 0 is well."""
        self._core.set_amplifier_status(status & 0xFFFFFFFF)
        self._look()

    def _quiet_until(self, now: float) -> float:
        """Return the time up to `now` [s] before which only the program's threads have something to do."""
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
        """Note what comes next, once for all who ask: until the next look only the plant can bring something else."""
        self._event_of_others = min([activity.next_event() for activity in self._active], default=inf)
        self._event = min(self._runner.next_event(), self._event_of_others)
        self._idle = self._core.idle

    def _take_in(self, handle: Handle, text: str) -> bytes:
        """Hand a line of a download to what takes it; the backslash ends it."""
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
    """Note what the other side of a handle that IH opened says; it answers, it does not command."""
    for byte in data:
        if byte in b":?":
            handle.attempt = Attempt.ACCEPTED if byte == ord(":") else Attempt.REFUSED
