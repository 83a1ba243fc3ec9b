"""The terminal's own commands, which begin with a colon, and its help."""

from __future__ import annotations

import asyncio
import re
import shlex
from collections.abc import Awaitable, Callable
from pathlib import Path

from dmc41x3.cli import program, scope
from dmc41x3.cli.scope import ChannelSample
from dmc41x3.cli.terminal import completion
from dmc41x3.cli.terminal.completion import WORDS
from dmc41x3.cli.terminal.session import TerminalSession
from dmc41x3.errors import CodedError, InvalidCommandLine, InvalidValue, MachineError, UnknownName
from dmc41x3.i18n import phrase

_HELP = re.compile(r"help(?:\s+(\S+))?|\?\s*(\S*)")


async def carry_out(session: TerminalSession, line: str) -> None:
    """Carry out one line: a command of the terminal, a request for help, or commands for the controller."""
    line = line.strip()
    if found := _HELP.fullmatch(line):
        session.voice.note(completion.page(found[1] or found[2] or ""))
    elif line.startswith(":"):
        try:
            await _own_word(session, line)
        except CodedError as error:
            session.refused = True
            if not isinstance(error, MachineError) or session.link.up:
                session.voice.trouble(str(error))
    elif line:
        await session.send(line)


async def _own_word(session: TerminalSession, line: str) -> None:
    word, _, rest = line.partition(" ")
    act = _TABLE.get(word)
    if act is None:
        raise UnknownName(name=word, known=", ".join(WORDS))
    await act(session, rest.strip())


async def _watch(session: TerminalSession, expression: str) -> None:
    if not expression:
        raise InvalidCommandLine(
            reason=":watch needs an expression, as in :watch _TPA", command=f"{session.site.command} terminal"
        )
    session.watched[expression] = ""


async def _unwatch(session: TerminalSession, expression: str) -> None:
    if not expression:
        session.watched.clear()
    elif session.watched.pop(expression, None) is None:
        raise UnknownName(name=expression, known=", ".join(session.watched) or "none")


async def _upload(session: TerminalSession, file: str) -> None:
    text = await session.link.driver.upload()
    if not file:
        session.voice.answer(text.rstrip("\n"))
        return
    program.write(Path(file), text)
    session.voice.note(f"Uploaded: {program.lines(text)} in {file}")


async def _download(session: TerminalSession, file: str) -> None:
    source = program.read(file)
    await program.load(session.link.driver, source.text)
    session.voice.note("; ".join((f"Downloaded: {program.lines(source.text)} from {file}", *source.changes)))
    await session.learn()


async def _scope(session: TerminalSession, rest: str) -> None:
    request = scope_request(rest, session.site.command)
    session.voice.note(f"Recording {', '.join(request.channels)} for {request.seconds:g} s.")
    session.beside(_record(session, request))


async def _record(session: TerminalSession, request: scope.ScopeRequest) -> None:
    taken: list[ChannelSample] = []
    try:
        await scope.record(session.link.driver, request, taken)
        recording = scope.ScopeRecording(request.channels, tuple(taken))
        scope.save(recording, request)
    except CodedError as error:
        session.voice.trouble(str(error))
    else:
        session.voice.note(scope.summary(recording, request))


def scope_request(text: str, command: str) -> scope.ScopeRequest:
    """Return the request in `CHANNELS --rate N --for S --trigger EXPR --csv FILE --png FILE`; errors name `command`.

    Raises `InvalidCommandLine`, `InvalidValue` and `UnknownName`.
    """
    try:
        channels, *words = shlex.split(text)
        options = dict(zip(words[::2], words[1::2], strict=True))
        rate, seconds = float(options.pop("--rate", "50")), float(options.pop("--for", "5"))
    except ValueError:
        reason = phrase(":scope takes {arguments}", arguments=WORDS[":scope"])
        raise InvalidCommandLine(reason=reason, command=f"{command} scope") from None
    unknown = options.keys() - {"--trigger", "--csv", "--png"}
    if unknown:
        raise UnknownName(name=min(unknown), known=", ".join(("--rate", "--for", "--trigger", "--csv", "--png")))
    if not options.keys() & {"--csv", "--png"}:
        raise InvalidCommandLine(reason=":scope needs --csv FILE or --png FILE", command=f"{command} scope")
    return scope.ScopeRequest(
        scope.split_channels(channels),
        rate,
        seconds,
        options.get("--trigger"),
        options.get("--csv"),
        options.get("--png"),
    )


async def _wait(_: TerminalSession, seconds: str) -> None:
    try:
        wanted = float(seconds)
    except ValueError:
        wanted = -1.0
    if not 0.0 <= wanted <= 3600.0:
        raise InvalidValue(key=":wait", value=repr(seconds), reason="it must be a number of seconds, 0 to 3600")
    await asyncio.sleep(wanted)


async def _stop(session: TerminalSession, _: str) -> None:
    await session.stop()


async def _messages(session: TerminalSession, _: str) -> None:
    await session.link.take_messages()
    session.voice.note("Messages of programs come here.")


async def _reconnect(session: TerminalSession, _: str) -> None:
    await session.reconnect()


async def _panel(session: TerminalSession, _: str) -> None:
    session.quiet = not session.quiet


async def _help(session: TerminalSession, name: str) -> None:
    session.voice.note(completion.page(name))


_TABLE: dict[str, Callable[[TerminalSession, str], Awaitable[None]]] = {
    ":watch": _watch,
    ":unwatch": _unwatch,
    ":upload": _upload,
    ":download": _download,
    ":scope": _scope,
    ":wait": _wait,
    ":stop": _stop,
    ":messages": _messages,
    ":reconnect": _reconnect,
    ":panel": _panel,
    ":help": _help,
}
