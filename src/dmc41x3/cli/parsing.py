"""A command line, parsed and carried out."""

from __future__ import annotations

from functools import cache

import typer

from dmc41x3.cli import console
from dmc41x3.cli.console import OutputSettings
from dmc41x3.errors import InvalidCommandLine

parser = cache(typer.main.get_command)
"""Returns the parser of an application's command lines. To build it takes longer than most commands."""


def run(app: typer.Typer, arguments: list[str], settings: OutputSettings, program: str) -> int:
    """Carry out a command line of `program` and return its exit code.

    Raises `InvalidCommandLine` for one that is not understood, and the errors of the command.
    """
    command = parser(app)
    try:
        code = command.main(arguments, prog_name=program, standalone_mode=False, obj=settings)
    except typer.TyperException as error:
        context = getattr(error, "ctx", None)
        reason = _clause(error.format_message()) or "the command is incomplete"
        raise InvalidCommandLine(reason=reason, command=context.command_path if context else program) from error
    return code if isinstance(code, int) else console.DONE


def _clause(message: str) -> str:
    """Return the parser's words without the end that the sentence of the error adds."""
    return " ".join(message.split()).replace(" Did you mean", " Perhaps you meant").rstrip(".?")
