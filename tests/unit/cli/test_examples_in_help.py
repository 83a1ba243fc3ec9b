"""The help of every command ends with an example that the command accepts."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

from dmc41x3.cli.commands import group
from dmc41x3.cli.parsing import EXAMPLE, parser
from maya_un.cli.app import app


def commands(command: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield every command below a group with the words that call it."""
    for name, inner in getattr(command, "commands", {}).items():
        if hasattr(inner, "commands"):
            yield from commands(inner, (*path, name))
        else:
            yield (*path, name), inner


ALL = [
    *commands(parser(app, ""), ("maya",)),
    *commands(parser(group(), ""), ("dmc",)),
]


@pytest.mark.parametrize(("path", "command"), ALL, ids=[" ".join(path) for path, _ in ALL])
def test_help_ends_with_an_example_that_is_accepted(path: tuple[str, ...], command: Any) -> None:
    last = command.epilog.strip().split("\n\n")[-1]
    assert last.startswith(EXAMPLE), f"the help of {' '.join(path)} ends with {last!r}"
    words = shlex.split(last.removeprefix(EXAMPLE).removeprefix("sudo ").partition(" > ")[0])
    assert tuple(words[: len(path)]) == path or (path[-1] == "fit" and words[:2] == ["maya", "calibrate"])
    arguments = words[len(path) :] if tuple(words[: len(path)]) == path else words[2:]
    with suppress(SystemExit), command.make_context(path[-1], arguments):
        pass


def test_there_are_many_commands() -> None:
    assert len(ALL) > 100
