"""Questions and waits of a job on a separate stack: a person answers in this terminal; a dry run answers by itself."""

from __future__ import annotations

import asyncio
import os
import sys
import termios
import threading
from contextlib import suppress

from dmc41x3.i18n import translate
from maya_un.assembly.stack import Stack
from maya_un.cli.progress import Display
from maya_un.errors import NotFound
from maya_un.events import InputAwaited, QuestionAsked
from maya_un.schema.jobs import OperatorQuestion


class LineReader:
    """Reads lines of the standard input in a thread, which does not delay the end of the program."""

    def __init__(self) -> None:
        self._rest = b""

    def discard_typed(self) -> None:
        """Discard what was typed at a terminal before the question that shows now; a pipe keeps its lines."""
        keyboard = _keyboard()
        if os.isatty(keyboard):
            self._rest = b""
            with suppress(termios.error):  # the terminal is gone, and the next reading finds the end of the input
                termios.tcflush(keyboard, termios.TCIFLUSH)

    async def line(self) -> str | None:
        """Return the next line, None at the end of the input."""
        loop = asyncio.get_running_loop()
        while b"\n" not in self._rest:
            read: asyncio.Future[bytes] = loop.create_future()

            def work(read: asyncio.Future[bytes] = read) -> None:
                try:
                    data = os.read(_keyboard(), 4096)
                except OSError:
                    data = b""
                loop.call_soon_threadsafe(lambda: read.done() or read.set_result(data))

            threading.Thread(target=work, name="answers", daemon=True).start()
            data = await read
            if not data:
                return None
            self._rest += data
        line, _, self._rest = self._rest.partition(b"\n")
        return line.decode(errors="replace").strip()


def _keyboard() -> int:
    """Return the descriptor of the standard input, -1 if it is closed."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # closed before or after the program began, or not a file
        return -1


async def answer_questions(robot: Stack, job: int, display: Display, language: str, *, dry: bool) -> None:
    """Answer the questions of a job while it runs: a person types the answers, and their end cancels the job.

    In a `dry` run each question gets its first answer, and an awaited input changes at once on the twin.
    """
    lines = LineReader()
    async for event in robot.controller.events.follow():
        if dry and isinstance(event, InputAwaited) and robot.twin is not None:
            machine = robot.twin.controller.machine
            machine.unit.inputs[event.input - 1] = event.state == "on"
            machine.look()
        elif isinstance(event, QuestionAsked):
            question = robot.service.queue.view().question
            if question is None:
                continue  # answered already
            answer = question.choices[0] if dry else await _typed(question, lines, display, language)
            if answer is None:
                await robot.service.cancel(job)
                return
            await _pass_on(robot, answer, question)


async def _typed(question: OperatorQuestion, lines: LineReader, display: Display, language: str) -> str | None:
    """Return one of the choices, typed in full; None at the end of the input."""
    choices = ", ".join(question.choices)
    while True:
        display.wait(translate("Type one of {choices}, then press Enter.", language, choices=choices))
        lines.discard_typed()
        line = await lines.line()
        if line is None or line in question.choices:
            return line


async def _pass_on(robot: Stack, answer: str, question: OperatorQuestion) -> None:
    """Answer a question, unless it has closed meanwhile."""
    try:
        await robot.service.queue.answer(answer, question.job, question.index)
    except NotFound:
        return
