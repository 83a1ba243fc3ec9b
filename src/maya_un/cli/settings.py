"""What holds for every command, wherever on the line it stands: --json, --lang, --config."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import takewhile
from typing import Any, NamedTuple, Protocol

from maya_un.errors import InvalidCommandLine, InvalidValue
from maya_un.messages import LANGUAGES

_WITH_VALUE = ("--lang", "--config")


class OutputSettings(NamedTuple):
    """How to answer: in which language, as JSON or as sentences; `config` is the file named, None without one."""

    language: str = "en"
    json: bool = False
    config: str | None = None


class CommandContext(Protocol):
    """A command's context, which carries the settings of the line."""

    obj: Any


def settings_of(context: CommandContext) -> OutputSettings:
    """Return what the whole line says."""
    settings = context.obj
    assert isinstance(settings, OutputSettings)
    return settings


def from_environment() -> OutputSettings:
    """Return what holds where the command line says nothing: $MAYA_LANG, English for a language we lack."""
    wanted = os.environ.get("MAYA_LANG", "en")[:2].lower()
    return OutputSettings(language=wanted if wanted in LANGUAGES else "en")


def asks_for_json(arguments: Sequence[str]) -> bool:
    """Tell whether answers are wanted as JSON, also where the rest of the line is not understood."""
    return "--json" in takewhile(lambda word: word != "--", arguments)


def split(arguments: Sequence[str], settings: OutputSettings) -> tuple[OutputSettings, list[str]]:
    """Take the options that hold everywhere out of `arguments`; return them and the rest, in order.

    Raises `InvalidCommandLine` for an option without its value and `InvalidValue` for an unknown language.
    """
    rest: list[str] = []
    words = iter(arguments)
    for word in words:
        name, given, value = word.partition("=")
        if word == "--":
            rest.extend(words)
        elif word == "--json":
            settings = settings._replace(json=True)
        elif name in _WITH_VALUE:
            settings = _with(settings, name, value if given else next(words, None))
        else:
            rest.append(word)
    return settings, rest


def _with(settings: OutputSettings, name: str, value: str | None) -> OutputSettings:
    if not value:
        raise InvalidCommandLine(reason=f"{name} needs a value", command="maya")
    if name == "--config":
        return settings._replace(config=value)
    if value not in LANGUAGES:
        raise InvalidValue(key=name, value=value, reason=f"it is one of {', '.join(LANGUAGES)}")
    return settings._replace(language=value)
