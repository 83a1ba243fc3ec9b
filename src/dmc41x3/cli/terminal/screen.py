"""The terminal on a screen: an input line, the panel below it, and all output above it."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from prompt_toolkit import PromptSession, print_formatted_text
from prompt_toolkit.application import get_app_or_none
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.formatted_text import FormattedText
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.renderer import print_formatted_text as print_to
from prompt_toolkit.styles import Style

from dmc41x3.cli import console
from dmc41x3.cli.connection import Dial
from dmc41x3.cli.console import Site
from dmc41x3.cli.signals import on_end
from dmc41x3.cli.terminal import completion
from dmc41x3.cli.terminal.completion import candidates, current_mnemonic
from dmc41x3.cli.terminal.pipe import QUIT
from dmc41x3.cli.terminal.session import Line, TerminalSession, axes, joined, stop_directly, threads, watched
from dmc41x3.cli.terminal.words import carry_out
from dmc41x3.errors import FileUnwritable
from dmc41x3.files import open_own

STALE = 1.0
"""The panel shows a warning if the controller has not answered for longer than this [s]."""

_KEYS = "F1 help  F2 panel  F5 reconnect  F12 STOP MOTION  Ctrl-C clear line  Ctrl-D end"
_STYLE = Style.from_dict(
    {
        "prompt": "bold",
        "bottom-toolbar": "noreverse",
        "rule": "ansibrightblack",
        "head": "ansibrightblack",
        "keys": "ansibrightblack",
        "letter": "bold",
        "off": "ansiyellow",
        "moving": "ansigreen bold",
        "active": "ansired bold",
        "quiet": "ansibrightblack",
        "help": "ansicyan",
        "note": "ansicyan",
        "message": "ansimagenta",
        "refused": "ansired bold",
        "trouble": "ansired bold",
        "lost": "bg:ansired ansiwhite bold",
    }
)


class TerminalScreen:
    """Shows output above the line that is being typed, without disturbing that line."""

    def __init__(self) -> None:
        self._waiting: list[tuple[str, str]] = []
        self._printing: asyncio.Task[None] | None = None

    def answer(self, text: str) -> None:
        """Show what the controller printed."""
        self.say("", text.replace("\r", ""))

    def refused(self, text: str) -> None:
        """Show a refusal in red."""
        self.say("class:refused", text)

    def message(self, text: str) -> None:
        """Show a message of a program, set apart by its colour and a sign."""
        self.say("class:message", f"« {text}")

    def note(self, text: str) -> None:
        """Show a note of the terminal."""
        self.say("class:note", text)

    def trouble(self, text: str) -> None:
        """Show an error."""
        self.say("class:trouble", text)

    def say(self, style: str, text: str) -> None:
        """Show a text in a style, after all earlier texts."""
        self._waiting.append((style, f"{text}\n"))
        if self._printing is None:
            self._printing = asyncio.get_running_loop().create_task(self._print())

    async def said(self) -> None:
        """Wait until everything has been shown."""
        if self._printing is not None:
            await self._printing

    async def _print(self) -> None:
        """Print above the line being typed, once its position on the screen is known.

        prompt_toolkit's own method releases the keyboard while it prints: the terminal would echo keys pressed then
        into the middle of the screen.
        """
        app = get_app_or_none()
        if app is not None and app.is_running:
            await app.renderer.wait_for_cpr_responses()
        said, self._waiting, self._printing = FormattedText(self._waiting), [], None
        if app is None or not app.is_running:
            print_formatted_text(said, style=_STYLE, end="")
            return
        app.renderer.erase()
        print_to(app.output, said, _STYLE)
        app.renderer.request_absolute_cursor_position()
        app.invalidate()


class _Completer(Completer):
    """Supplies the completions of the line to the menu."""

    def __init__(self, session: TerminalSession) -> None:
        self._session = session

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        """Yield the completions of the line."""
        for found in candidates(document.text_before_cursor, self._session.names):
            yield Completion(found.text, -found.replaces, display_meta=found.meaning)


def history(place: Path) -> History:
    """Return the history stored in the file `place`, or one in memory if the file cannot be opened."""
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        os.close(open_own(place, os.O_CREAT | os.O_RDWR))
    except (OSError, FileUnwritable):
        return InMemoryHistory()
    return FileHistory(place)


async def converse(dial: Dial, place: str, site: Site) -> int:
    """Run the terminal until Ctrl-D, `:quit` or SIGTERM; return the exit code. Raises `ConnectFailed`."""
    screen = TerminalScreen()
    session = TerminalSession(dial, place, screen, stop_directly(place), site)
    tasks: list[asyncio.Task[None]] = []
    try:
        await session.connect()
        screen.note("Tab completes, `help TP` explains. F12 stops motion, Ctrl-C does not.")
        await screen.said()
        tasks = [asyncio.create_task(session.work(carry_out)), asyncio.create_task(session.watch())]
        await _type(session)
    finally:
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)
        await session.close()
        await screen.said()
    return console.DONE


async def _type(session: TerminalSession) -> None:
    prompt: PromptSession[str] = PromptSession(
        history=history(session.site.history()),
        completer=_Completer(session),
        complete_while_typing=True,
        bottom_toolbar=lambda: _toolbar(session),
        key_bindings=_keys(session),
        style=_STYLE,
        refresh_interval=0.2,
        reserve_space_for_menu=6,
    )
    with on_end(_end, signal.SIGTERM), prompt.input.raw_mode(), suppress(EOFError):
        while (line := await prompt.prompt_async([("class:prompt", ": ")], handle_sigint=False)).strip() not in QUIT:
            if line.strip():
                session.enter(line)


def _end() -> None:
    app = get_app_or_none()
    if app is not None and app.is_running:
        app.exit(exception=EOFError())


def _keys(session: TerminalSession) -> KeyBindings:
    keys = KeyBindings()

    @keys.add("c-c")
    def clear(event: KeyPressEvent) -> None:
        if not event.current_buffer.text:
            session.voice.note("Ctrl-C stops nothing. F12 stops motion, Ctrl-D ends.")
        event.current_buffer.reset()

    @keys.add("f1")
    def help_page(event: KeyPressEvent) -> None:
        session.voice.note(completion.page(current_mnemonic(event.current_buffer.document.text_before_cursor)))

    @keys.add("f2")
    def axes(event: KeyPressEvent) -> None:
        session.quiet = not session.quiet

    @keys.add("f5")
    def reconnect(event: KeyPressEvent) -> None:
        session.beside(session.reconnect())

    @keys.add("f12")
    def stop(event: KeyPressEvent) -> None:
        session.beside(session.stop())

    return keys


def _toolbar(session: TerminalSession) -> FormattedText:
    app = get_app_or_none()
    width = app.output.get_size().columns if app is not None else 80
    typed = app.current_buffer.document.text_before_cursor if app is not None else ""
    return FormattedText(joined(below(session, typed, width)))


def below(session: TerminalSession, typed: str, width: int) -> list[Line]:
    """Return everything below the line being typed: help, axes, watched values, link, keys."""
    lines: list[Line] = [[("class:rule", "─" * width)]]
    entry = completion.entry(current_mnemonic(typed))
    if entry is not None:
        lines[0] = [("class:help", completion.line(entry)[:width].ljust(width))]
    if not session.quiet and session.record is not None:
        lines += axes(session.record, width)
    lines += watched(session.watched, width)
    lines.append(_state(session, width))
    lines.append([("class:keys", _KEYS[:width])])
    return lines


def _state(session: TerminalSession, width: int) -> Line:
    if not session.link.up:
        return [("class:lost", f" LINK LOST  {session.place}   F5 connects again "[:width].ljust(width))]
    words = [session.place]
    if session.record is not None and (running := threads(session.record)):
        words.append(f"threads {running} run")
    if session.waiting:
        words.append(f"{session.waiting} waiting for an answer")
    if not session.quiet and session.silence > STALE:
        words.append(f"no answer for {session.silence:.0f} s")
    return [("class:letter", "   ".join(words)[:width])]
