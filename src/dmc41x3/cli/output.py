"""Print sentences, JSON, and errors with their code; map error codes to exit codes."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from io import TextIOWrapper
from pathlib import Path
from typing import cast

from dmc41x3.cli.settings import OutputSettings
from dmc41x3.errors import CodedError, FileUnwritable

DONE = 0
"""Everything asked for was done."""

FAILED = 1
"""The command was understood but not carried out, or not to its end."""

REFUSED = 2
"""The command line, a value, a file or the configuration is wrong; nothing was tried."""

INTERRUPTED = 130
"""Ctrl-C ended it; motion was stopped on its path."""


def tolerate_any_terminal() -> None:
    """Show `?` for a letter that the terminal's encoding lacks, rather than fail on it, and read what is none as such.

    Without an input, as under a service manager, reading finds the end of a file.
    """
    if cast("object", sys.stdin) is None:
        sys.stdin = Path(os.devnull).open(encoding="utf-8")  # noqa: SIM115 - for as long as the process lives
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")


def say(text: str) -> None:
    """Print one line for people, in one piece, so that a reader never sees half of it."""
    _print(f"{text}\n")


def emit(value: object) -> None:
    """Print `value` as JSON; its keys are stable."""
    _print(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False, default=str) + "\n")


def _print(text: str) -> None:
    """Print; raises `FileUnwritable`, and `BrokenPipeError` if the reader is gone."""
    try:
        print(text, end="", flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise FileUnwritable(path="stdout", reason=error.strerror or str(error)) from error


def forget_unprinted() -> None:
    """Drop unprinted output if the reader is gone; otherwise the interpreter reports it again at its end."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def answer(value: Mapping[str, object], text: str, settings: OutputSettings) -> int:
    """Print an answer as JSON (`value`) or as `text`, as the settings say, and return the exit code of success."""
    if settings.json:
        emit(value)
    else:
        say(text)
    return DONE


def complain(error: CodedError, settings: OutputSettings, program: str = "dmc") -> int:
    """Print an error of `program`, one sentence with its code (or JSON), and return its exit code.

    If JSON cannot be printed, the sentence goes to the error line.
    """
    try:
        _print_error(error, settings, program)
    except BrokenPipeError:
        pass  # the reader is gone; the exit code tells the rest
    except CodedError:
        _print_error(error, settings._replace(json=False), program)
    return exit_code(error.code)


def _print_error(error: CodedError, settings: OutputSettings, program: str) -> None:
    text = error.text(settings.language)
    if settings.json:
        details = {key: _plain(value) for key, value in error.details.items()}
        emit({"error": {"code": error.code, "message": text, "details": details}})
    else:
        with suppress(OSError):  # then nobody is there to be told
            print(f"{program}: error {error.code}: {text}", file=sys.stderr, flush=True)


def exit_code(code: int) -> int:
    """Return the exit code of an error's code: 2 for wrong requests and files (4xxx, 5xxx), else 1."""
    return REFUSED if 4000 <= code < 5999 else FAILED


def _plain(value: object) -> object:
    """Return a detail as it is where JSON can say it, else as text."""
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError):
        return str(value)
    return value
