"""A DMC-4133 without a wire: bytes of a connection in, bytes of its reply out, at a time that the caller tells.

The machine never waits and never looks at a clock. It obeys whatever bytes come and never raises for any of them.
"""

from __future__ import annotations

import re

from maya_un.galil.codes import ErrorCode
from maya_un.galil.commands import TOO_LONG
from maya_un.virtual.arguments import QUERY
from maya_un.virtual.commands import TABLE
from maya_un.virtual.context import Answer, Context
from maya_un.virtual.expressions import ONE, evaluate, is_name
from maya_un.virtual.handles import Handle
from maya_un.virtual.operands import Names
from maya_un.virtual.plant import Plant
from maya_un.virtual.refusal import Refused
from maya_un.virtual.unit import Identity, Unit

FIRMWARE = "DMC4133 Rev 1.3k"
SERIAL = 41330
ADDRESS = (10, 51, 0, 87)
HARDWARE_ADDRESS = "00-50-4C-08-01-1F"
MOST_VARIABLES = 510

_ASSIGNMENT = re.compile(r"([A-Za-z][A-Za-z0-9]*)\s*=(?!=)\s*(.*)")


class VirtualDmc:
    """The controller.

    `plant` is what its motors drive, `axes` how many there are (1 to 8), `motors_off` whether motors power up off.
    Times are seconds on one clock of the caller's that never goes back.
    """

    def __init__(
        self,
        plant: Plant,
        *,
        axes: int = 3,
        firmware: str = FIRMWARE,
        serial: int = SERIAL,
        motors_off: bool = True,
    ) -> None:
        if not 1 <= axes <= 8:
            raise ValueError("a DMC-41x3 has one to eight axes")
        self._unit = Unit(plant, axes, Identity(firmware, serial, ADDRESS, HARDWARE_ADDRESS), motors_off)
        self._core = self._unit.core
        self._contexts: dict[Handle, Context] = {}
        self._outbox: list[tuple[Handle, bytes]] = []

    @property
    def now(self) -> float:
        """The time advanced to [s]."""
        return self._core.now

    @property
    def unit(self) -> Unit:
        """What the controller remembers; for those who look into it from outside, such as tests."""
        return self._unit

    def connect(self, peer: tuple[str, int] = ("127.0.0.1", 0)) -> Handle | None:
        """Give a new connection the first free handle, None where all eight are taken."""
        handle = self._unit.handles.connect(peer)
        if handle is not None:
            self._contexts[handle] = Context(self._unit, handle, Names(self._unit, handle), self._outbox)
        return handle

    def disconnect(self, handle: Handle) -> None:
        """Take a handle back whose connection ended; motion goes on. Again is harmless."""
        self._unit.handles.close(handle)
        self._contexts.pop(handle, None)

    def receive(self, handle: Handle, data: bytes, now: float) -> bytes:
        """Execute the commands that `data` completes, at time `now` [s], and return their replies.

        A command may close handles, the sender's among them: see `Handle.open` afterwards.
        """
        self._core.advance(now)
        replies: list[bytes] = []
        for text in handle.splitter.feed(data):
            context = self._contexts.get(handle)
            if context is None or not handle.open:
                break
            replies.append(self._reply(context, text))
        return b"".join(replies)

    def advance(self, now: float) -> None:
        """Bring the controller and its plant to time `now` [s]."""
        self._core.advance(now)

    def next_event(self, until: float) -> float | None:
        """Return when in (now, until] something happens by itself [s], None where nothing does."""
        return self._core.next_event(until)

    def take_messages(self) -> list[tuple[Handle, bytes]]:
        """Return the bytes for handles that did not ask for them, and forget them."""
        messages, self._outbox[:] = list(self._outbox), []
        return messages

    def abort_input(self, active: bool) -> None:
        """Set the abort input at the time last advanced to."""
        self._core.set_abort_input(active)

    def amplifier_fault(self, status: int) -> None:
        """Set the amplifiers' fault bits, laid out as in the data record, at the time last advanced to; 0 is well."""
        self._core.set_amplifier_status(status & 0xFFFFFFFF)

    def _reply(self, context: Context, text: str) -> bytes:
        try:
            answer = _execute(context, text)
        except Refused as refused:
            self._unit.error_code = int(refused.code)
            return b"?"
        if answer is None:
            return b":"
        return answer + b":" if isinstance(answer, bytes) else answer.encode("ascii") + b"\r\n:"


def _execute(context: Context, text: str) -> Answer:
    """Execute one command; raises `Refused`."""
    handler = TABLE.get(text[:2])
    if handler is not None:
        return handler(context, text[2:])
    if not text or text[0] == "'":
        return None
    if text.startswith(TOO_LONG):
        raise Refused(ErrorCode.INPUT_BUFFER_FULL)
    assignment = _ASSIGNMENT.fullmatch(text)
    if assignment is None:
        raise Refused(ErrorCode.UNRECOGNIZED_COMMAND)
    return _assign(context, *assignment.groups())


def _assign(context: Context, name: str, value: str) -> Answer:
    """Set a variable, or print it for `v=` and `v=?`."""
    if not is_name(name) or name == "TIME":
        raise Refused(ErrorCode.VARIABLE_ERROR)
    unit = context.unit
    if value in ("", QUERY):
        return unit.value_text(context.names.variable(name) / ONE)
    result = evaluate(value, context.names)
    if name not in unit.variables and len(unit.variables) >= MOST_VARIABLES:
        raise Refused(ErrorCode.TOO_MANY_VARIABLES)
    unit.variables[name] = result
    return None
