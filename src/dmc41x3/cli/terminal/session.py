"""The session of a terminal: its link, input lines and answers in order, the axes, and stopping.

Stopping names the axes: a bare ST would also end the programs in the controller (DMC-41x3, command ST).

This module neither waits for the user nor draws on a screen. Lines run one after the other in the background.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Mapping
from contextlib import suppress
from functools import partial
from itertools import pairwise
from typing import Protocol, TypeAlias

from dmc41x3.address import SIM, parse
from dmc41x3.cli.connection import TIMEOUT, Dial
from dmc41x3.cli.console import ALONE, Site
from dmc41x3.cli.terminal import completion
from dmc41x3.cli.terminal.completion import CompletionNames, ask, assigned
from dmc41x3.driver import Driver
from dmc41x3.errors import CodedError, CommandRejected, MachineError, NotConnected
from dmc41x3.language.codes import STOP_TEXTS
from dmc41x3.language.commands import CONTROL, FORMS, split_line
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import AxisRecord, AxisSwitches, DataRecord
from dmc41x3.wire import emergency
from dmc41x3.wire.emergency import StopOutcome


class SessionOutput(Protocol):
    """Output of a session. No method waits."""

    def answer(self, text: str) -> None:
        """Show what the controller printed, a colon for an empty answer."""
        ...

    def refused(self, text: str) -> None:
        """Show that the controller refused a command, with code and words."""
        ...

    def message(self, text: str) -> None:
        """Show a line that a program in the controller sent by itself."""
        ...

    def note(self, text: str) -> None:
        """Show a note of the terminal itself."""
        ...

    def trouble(self, text: str) -> None:
        """Show an error of the terminal or of the link."""
        ...


_PATIENCE = 2.0
"""Longest wait for each answer of the controller during a direct stop [s]."""


async def stop(driver: Driver) -> StopOutcome:
    """Stop all motion and return which axes moved; sends the first bytes before it waits. Raises as `send`."""
    for plane in "ST":
        driver.urgent(f"ST {plane}")
    axes = list(zip(LETTERS, (await driver.record()).axes, strict=False))
    outcome = StopOutcome(
        coordinated="".join(letter for letter, axis in axes if axis.moving and axis.coordinated),
        independent="".join(letter for letter, axis in axes if axis.moving and not axis.coordinated),
    )
    if outcome.independent:
        await driver.send(f"ST {outcome.independent}")
    return outcome


def stop_directly(place: str) -> Callable[[], StopOutcome] | None:
    """Return a function that stops the controller over a separate connection; None for a twin, which has no address.

    The function blocks; see `emergency.stop`.
    """
    return None if place == SIM else partial(emergency.stop, parse(place), _PATIENCE)


_SERIAL = ord("S")
"""Value of CF after power-up: messages go to the serial port, so no network client receives them."""


class TerminalLink:
    """The link to one controller; `dial` opens it, also repeatedly."""

    def __init__(self, dial: Dial, on_message: Callable[[str], None], on_loss: Callable[[MachineError], None]) -> None:
        self._dial = dial
        self._on_message = on_message
        self._on_loss = on_loss
        self._driver: Driver | None = None
        self._marked = 2.0
        self._receiver = _SERIAL
        self._one_at_a_time = asyncio.Lock()
        self.messages = False

    @property
    def driver(self) -> Driver:
        """The driver of the open link; raises `NotConnected` if there is none."""
        if self._driver is None or self._driver.lost.done():
            raise NotConnected
        return self._driver

    @property
    def up(self) -> bool:
        """Whether the link is open."""
        return self._driver is not None and not self._driver.lost.done()

    async def connect(self) -> None:
        """Connect again; receive the programs' messages if no other client does. Raises `ConnectFailed`."""
        async with self._one_at_a_time:
            await self._connect()

    async def _connect(self) -> None:
        await self.close()
        driver = await Driver.open(await self._dial(), timeout=TIMEOUT)
        driver.on_message = self._on_message
        driver.lost.add_done_callback(self._lost)
        self._driver = driver
        try:
            if await _number(driver, "_CF", _SERIAL) == _SERIAL:
                await self.take_messages()
        except MachineError:
            await self.close()
            raise

    async def take_messages(self) -> None:
        """Direct the programs' messages to this link (CF I, CW 1), even if another client receives them."""
        if not self.messages:
            self._marked = await _number(self.driver, "_CW", 2)
            self._receiver = int(await _number(self.driver, "_CF", _SERIAL))
        await self.driver.subscribe()
        self.messages = True

    async def close(self) -> None:
        """Restore CF and CW if this link changed them, and end the link; idempotent."""
        driver, self._driver = self._driver, None
        if driver is None:
            return
        if self.messages and not driver.lost.done():
            await self._give_back(driver)
        self.messages = False
        await driver.close()

    async def _give_back(self, driver: Driver) -> None:
        """Return the messages to their former receiver, or to the serial port if that has disconnected."""
        receiver = chr(self._receiver)
        try:
            if receiver in LETTERS and await driver.value(f"_IH{receiver}2") == 0.0:
                receiver = chr(_SERIAL)
            await driver.batch([f"CF {receiver}", f"CW {self._marked:.0f}"])
        except CodedError:
            return  # the controller itself changes CF when the handle closes

    def _lost(self, lost: asyncio.Future[MachineError]) -> None:
        if not lost.cancelled():
            self._on_loss(lost.result())


async def _number(driver: Driver, operand: str, default: float) -> float:
    try:
        return await driver.value(operand)
    except CommandRejected:
        return default


Piece: TypeAlias = tuple[str, str]
"""A style and a text."""

Line: TypeAlias = list[Piece]

HEAD = "     position velocity  error  torque motor  motion  lim stop code"
"""Names of the columns; `lim` shows F, R and H for an active forward, reverse and home switch."""


def axes(record: DataRecord, width: int) -> list[Line]:
    """Return a header and one line for each axis.

    A line shows position [counts], velocity [counts/s], error [counts], torque [V], motor, motion, switches, stop code.
    """
    rows = zip(LETTERS, record.axes, strict=False)
    return [[("class:head", HEAD[:width])], *(_axis(letter, axis, width) for letter, axis in rows)]


def _axis(letter: str, axis: AxisRecord, width: int) -> Line:
    line: Line = [
        ("class:letter", letter),
        ("", f" {axis.position:>11} {axis.velocity:>8.0f} {axis.error:>6} {axis.torque:>6.2f}V"),
        ("class:off", "   off") if axis.motor_off else ("", "    on"),
        ("class:moving", "  moving ") if axis.moving else ("", "  at rest"),
        ("", " "),
        _switch("F", axis.forward_limit_active, "class:active"),
        _switch("R", axis.reverse_limit_active, "class:active"),
        _switch("H", bool(axis.switches & AxisSwitches.HOME_INPUT), "class:letter"),
    ]
    left = width - sum(len(text) for _, text in line)
    words = f" {axis.stop_code:>3} {STOP_TEXTS.get(axis.stop_code, '')}"
    return [*line, ("", words if len(words) <= left else words[: left - 1] + "…")]


def _switch(letter: str, active: bool, style: str) -> Piece:
    return (style, letter) if active else ("class:quiet", "·")


def watched(values: Mapping[str, str], width: int) -> list[Line]:
    """Return the watched expressions with their values, packed into lines."""
    lines: list[Line] = []
    used = width
    for expression, value in values.items():
        refused = value.startswith("?")
        pieces: Line = [("class:letter", f"{expression} "), ("class:refused" if refused else "", value)]
        length = sum(len(text) for _, text in pieces)
        if used + 3 + length > width:
            lines.append([])
            used = 0
        elif used:
            lines[-1].append(("", "   "))
            used += 3
        lines[-1] += pieces
        used += length
    return lines


def threads(record: DataRecord) -> str:
    """Return which threads of the program run, empty for none."""
    return " ".join(str(number) for number in range(8) if record.threads >> number & 1)


def joined(lines: Iterable[Line]) -> Line:
    """Return lines joined into one, with line ends between them."""
    shown = list(lines)
    pieces: Line = list(shown[0]) if shown else []
    for _, line in pairwise(shown):
        pieces += [("", "\n"), *line]
    return pieces


def plain(lines: Iterable[Line]) -> str:
    """Return lines as text without styles."""
    return "\n".join("".join(text for _, text in line).rstrip() for line in lines)


REFRESH = 0.2
"""Time between two updates of the panel [s]."""

RETRY = 10
"""A refused watched expression is evaluated again every so many updates, because each refusal costs a TC1."""

SLOW = {"BN": 30.0, "BP": 30.0, "BV": 30.0, "BX": 60.0, "BZ": 60.0}
"""Commands that take long, and the longest wait for their reply [s]."""

_ELSEWHERE = {
    "DL": "a program goes in by :download FILE",
    "ED": "a program goes in by :download FILE",
    "QD": "its data would be taken for commands",
}
_RENAMES = re.compile(r"DM|DA|XQ|DL")


class TerminalSession:
    """A link, the lines sent over it, and the content of the panel.

    `directly`, if not None, stops the controller without the link. `work` and `watch` each run in their own task;
    `enter` adds a line. `waiting` is the number of lines without an answer, `refused` whether any command was refused,
    `quiet` whether the panel is hidden.
    """

    def __init__(
        self,
        dial: Dial,
        place: str,
        voice: SessionOutput,
        directly: Callable[[], StopOutcome] | None = None,
        site: Site = ALONE,
    ) -> None:
        self.place = place
        self.site = site
        self._directly = directly
        self.voice = voice
        self.link = TerminalLink(dial, voice.message, self._on_loss)
        self.names = CompletionNames()
        self.record: DataRecord | None = None
        self.watched: dict[str, str] = {}
        self.waiting = 0
        self.refused = False
        self.trouble = ""
        self.quiet = False
        self._looked = 0.0
        self._lines: asyncio.Queue[str] = asyncio.Queue()
        self._beside: set[asyncio.Task[None]] = set()

    @property
    def silence(self) -> float:
        """Age of the panel's values [s]."""
        return asyncio.get_running_loop().time() - self._looked if self.record is not None else 0.0

    async def connect(self) -> None:
        """Connect and show the firmware; raises `ConnectFailed`, and the driver's errors for a silent controller."""
        await self.link.connect()
        self.trouble = ""
        await self._look()
        await self.learn()
        firmware = await self.link.driver.send(CONTROL["^R^V"])
        self.voice.note(f"{firmware} at {self.place}")
        if not self.link.messages:
            self.voice.note("Messages of programs go to another handle; `:messages` has them come here.")

    async def reconnect(self) -> None:
        """Connect again and show the result; does not raise if the controller is not available."""
        self.voice.note(f"Connecting to {self.place} ...")
        try:
            await self.connect()
        except CodedError as error:
            self.trouble = str(error)
            self.voice.trouble(str(error))

    def enter(self, line: str) -> None:
        """Take a line; its result is shown later, in order. A stop does not wait for other lines."""
        if line.strip() == ":stop":
            self.beside(self.stop())
            return
        self.waiting += 1
        self._lines.put_nowait(line)

    async def work(self, carry_out: Callable[[TerminalSession, str], Awaitable[None]]) -> None:
        """Carry out lines as they are entered; runs until it is cancelled."""
        while True:
            line = await self._lines.get()
            try:
                await carry_out(self, line)
            finally:
                self.waiting -= 1
                self._lines.task_done()

    async def watch(self) -> None:
        """Update the panel's values; runs until it is cancelled."""
        turn = 0
        while True:
            await asyncio.sleep(REFRESH)
            if not self.link.up or self.quiet:
                continue
            with suppress(CodedError):  # the link reports its loss
                await self._look()
                await self._evaluate(turn)
            turn += 1

    async def _look(self) -> None:
        self.record = await self.link.driver.record()
        self._looked = asyncio.get_running_loop().time()

    async def _evaluate(self, turn: int) -> None:
        for expression, value in list(self.watched.items()):
            if value.startswith("?") and turn % RETRY:
                continue
            shown = await _value(self.link.driver, expression)
            if expression in self.watched:
                self.watched[expression] = shown

    async def learn(self) -> None:
        """Read the names for completion from the controller."""
        axes = LETTERS[: len(self.record.axes)] if self.record is not None else "ABC"
        self.names = await ask(self.link.driver, axes)

    async def send(self, line: str) -> None:
        """Send the commands of a line in order and show each answer; a refused command does not end the line."""
        for command in split_line(line):
            if not command:
                continue
            try:
                await self._send(command)
            except CommandRejected as error:
                self._refusal(command, error)
            except NotConnected:
                self.voice.trouble(f"Not sent: {command}. There is no link; F5 or :reconnect makes it again.")
                return
            except MachineError:
                return  # the link reports its loss
            except CodedError as error:
                self.refused = True
                self.voice.trouble(str(error))

    async def _send(self, command: str) -> None:
        driver = self.link.driver
        reason = _elsewhere(command)
        if reason is not None:
            self.refused = True
            self.voice.trouble(f"Not sent: {command}: {reason}.")
            return
        if command == "QR":
            self.voice.answer(plain(axes(await driver.record(), 120)))
            return
        patience = SLOW.get(command[:2])
        answer = await driver.exact(CONTROL.get(command, command), timeout=patience)
        self.voice.answer(answer or ":")
        if (name := assigned(command)) is not None and command[:2] not in FORMS:
            self.names = self.names.with_variable(name)
        elif _RENAMES.match(command):
            await self.learn()

    def _refusal(self, command: str, error: CommandRejected) -> None:
        self.refused = True
        hint = ""
        if command[:2].islower() and completion.entry(command[:2].upper()) is not None:
            hint = f"  (commands are written in capitals: {command[:2].upper()})"
        self.voice.refused(f"? {error.details['tc']} {error.details['reason']}{hint}")

    async def stop(self) -> None:
        """Stop all moving axes ahead of waiting lines and show which moved; never raises.

        If the link does not work, this method uses a separate handle.
        """
        try:
            outcome = await self._stop()
        except CodedError as error:
            self.voice.trouble(f"NOT STOPPED by this terminal: {error}")
            return
        moved = outcome.decelerating
        self.voice.note(f"Stopping {', '.join(moved)}." if moved else "Nothing moves.")
        if self.record is not None and (running := threads(self.record)):
            self.voice.note(f"Programs still run (thread {running}) and may move again; HX ends them.")

    async def _stop(self) -> StopOutcome:
        try:
            return await stop(self.link.driver)
        except CodedError:
            if self._directly is None:
                raise
        return await asyncio.to_thread(self._directly)

    def _on_loss(self, error: MachineError) -> None:
        self.trouble = str(error)
        self.voice.trouble(f"LINK LOST: {error} F5 or :reconnect makes it again.")

    def beside(self, work: Coroutine[None, None, None]) -> None:
        """Run `work` beside the lines; `close` cancels it if it is still running."""
        task = asyncio.get_running_loop().create_task(work)
        self._beside.add(task)
        task.add_done_callback(self._beside.discard)

    async def answered(self) -> None:
        """Wait until every line has been carried out; work that runs beside the lines may continue."""
        await self._lines.join()

    async def settled(self) -> None:
        """Wait until every line has been carried out, and all work beside the lines is done."""
        await self.answered()
        while self._beside:
            await asyncio.wait(set(self._beside))

    async def close(self) -> None:
        """Cancel the work beside the lines, and end the link."""
        for task in tuple(self._beside):
            task.cancel()
        if self._beside:
            await asyncio.wait(set(self._beside))
        await self.link.close()


async def _value(driver: Driver, expression: str) -> str:
    try:
        return (await driver.send(f"MG {expression}")).strip()
    except CommandRejected as error:
        return f"?{error.details['tc']}"


def _elsewhere(command: str) -> str | None:
    """Return why the terminal does not send a command: its data or answer has no clear end. None if it sends it."""
    if command.startswith("MG") and re.search(r"\{N\}\s*$", command):
        return "an answer without a line end cannot be separated from the next"
    for name, reason in _ELSEWHERE.items():
        if command.startswith(name) and command[2:].strip() not in {"?", "=?"} and "=" not in command:
            return reason
    return None
