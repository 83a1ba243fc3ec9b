"""Parse and execute a command line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from copy import copy
from difflib import get_close_matches
from functools import cache

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command_name, get_group
from typer.models import CommandInfo, TyperInfo

from dmc41x3.cli import console
from dmc41x3.cli.console import OutputSettings
from dmc41x3.errors import InvalidCommandLine
from dmc41x3.i18n import PHRASE, marked, phrase

EXAMPLE = "Example: "
"""Begins the last paragraph of the docstring of every command."""


def parser(app: typer.Typer, name: str) -> TyperGroup:
    """Return the parser of an application for its command or group `name`; for all of them if it has none.

    To build it for all of them takes longer than most commands.
    """
    known = any(name == _name(info) for info in (*app.registered_commands, *app.registered_groups))
    return _built(app, name if known else None)


@cache
def _built(app: typer.Typer, name: str | None) -> TyperGroup:
    if name is not None:
        whole, app = app, copy(app)
        app.registered_commands = [info for info in whole.registered_commands if _name(info) == name]
        app.registered_groups = [info for info in whole.registered_groups if _name(info) == name]
    group = get_group(app)
    _end_with_examples(group)
    return group


def _end_with_examples(command: TyperCommand | TyperGroup) -> None:
    """Move the example at the end of the help of each command behind its options, where people look for it."""
    for inner in command.commands.values() if isinstance(command, TyperGroup) else ():
        assert isinstance(inner, TyperCommand | TyperGroup)
        _end_with_examples(inner)
    text, found, example = (command.help or "").rpartition(EXAMPLE)
    if found:
        command.help = text.rstrip()
        command.epilog = "\n\n".join(filter(None, (command.epilog, EXAMPLE + example)))


def _name(info: CommandInfo | TyperInfo) -> str:
    return info.name or get_command_name(getattr(info.callback, "__name__", ""))


def run(
    app: typer.Typer, arguments: list[str], settings: OutputSettings, program: str, others: Sequence[str] = ()
) -> int:
    """Execute a command line of `program` and return its exit code.

    `others` are commands outside `app`: a misspelt one is suggested.

    Raises `InvalidCommandLine` if the command line is not valid, and the errors of the command.
    """
    command = parser(app, arguments[0] if arguments else "")
    try:
        code = command.main(arguments, prog_name=program, standalone_mode=False, obj=settings)
    except typer.TyperException as error:
        context = getattr(error, "ctx", None)
        reason = _unknown_option(arguments, context) or _clause(error.format_message())
        meant = get_close_matches(arguments[0], others, 1) if arguments else []
        if meant and reason == f"No such command {arguments[0]!r}":
            reason += f". Perhaps you meant {meant[0]!r}"
        reason = reason or phrase("the command is incomplete")
        raise InvalidCommandLine(reason=reason, command=context.command_path if context else program) from error
    return code if isinstance(code, int) else console.DONE


def _unknown_option(arguments: list[str], context: typer.Context | None) -> str:
    """Return the parser's message about the first unknown option in `arguments`, "" if there is none.

    A command parses an unknown option as an argument, because a negative number begins like an option.
    """
    if context is None or not context.ignore_unknown_options:
        return ""
    known = [name for parameter in context.command.params for name in parameter.opts if name.startswith("--")]
    for word in arguments:
        name = word.partition("=")[0]
        if name.startswith("--") and len(name) > 2 and name not in {*known, *context.help_option_names}:
            others = ", ".join(get_close_matches(name, known))
            return f"No such option: {name} (Possible options: {others})" if others else f"No such option: {name}"
    return ""


_PARSER = (
    marked("Missing argument {name}", PHRASE),
    marked("Missing option {name}", PHRASE),
    marked("Missing parameter: {name}", PHRASE),
    marked("No such command {name}", PHRASE),
    marked("No such command {name}. Perhaps you meant {other}", PHRASE),
    marked("No such option: {name}", PHRASE),
    marked("No such option: {name} (Possible options: {others})", PHRASE),
    marked("Got unexpected extra argument(s) ({arguments})", PHRASE),
    marked("Option {name} requires an argument", PHRASE),
    marked("Option {name} does not take a value", PHRASE),
    marked("Argument {name} takes {count} values", PHRASE),
    marked("Invalid value for {name}: {reason}", PHRASE),
    marked("{value} is not a whole number", PHRASE),
    marked("{value} is not a number", PHRASE),
    marked("{value} is not in the range {range}", PHRASE),
    marked("{value} is not one of {choices}", PHRASE),
)
"""Messages of the parser, as `_clause` returns them: they are translated as phrases of ours."""


_KINDS = (
    (re.compile(r"a valid int(eger)?( range)?$"), "a whole number"),
    (re.compile(r"a valid float( range)?$"), "a number"),
)
"""Names of types in the parser's messages, and what people call them."""


def _clause(message: str) -> str:
    """Return the parser's message in our words, without the ending that the error's sentence adds."""
    text = " ".join(message.split()).replace(" Did you mean", " Perhaps you meant").rstrip(".?")
    for found, words in _KINDS:
        text = found.sub(words, text)
    return text
