"""The options of every command, wherever on the line they stand: --json, --lang."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import takewhile
from typing import Any, NamedTuple, Protocol

from dmc41x3.cli.site import ALONE, Site
from dmc41x3.errors import InvalidCommandLine, InvalidValue
from dmc41x3.i18n import LANGUAGES


class OutputSettings(NamedTuple):
    """How to answer: in which language, as JSON or as sentences; `site` knows the surroundings.

    `config` is the configuration file named on the line, None without one; `dmc` has no such option.
    """

    language: str = "en"
    json: bool = False
    config: str | None = None
    site: Site = ALONE


class CommandContext(Protocol):
    """A command's context, which carries the settings of the line."""

    obj: Any


def settings_of(context: CommandContext) -> OutputSettings:
    """Return the settings of the whole line."""
    settings = context.obj
    assert isinstance(settings, OutputSettings)
    return settings


def from_environment(variable: str = "DMC_LANG") -> OutputSettings:
    """Return the settings of an empty line: the language in `variable`, English for a language we lack."""
    wanted = os.environ.get(variable, "en")[:2].lower()
    return OutputSettings(language=wanted if wanted in LANGUAGES else "en")


def asks_for_json(arguments: Sequence[str]) -> bool:
    """Tell whether answers are wanted as JSON, also where the rest of the line is not understood."""
    return "--json" in takewhile(lambda word: word != "--", arguments)


def split(
    arguments: Sequence[str],
    settings: OutputSettings,
    command: str = "dmc",
    with_value: Sequence[str] = ("--lang",),
) -> tuple[OutputSettings, list[str]]:
    """Take the options that hold everywhere out of `arguments`; return them and the rest, in order.

    `with_value` are those of --lang and --config that `command` has. Raises `InvalidCommandLine` for an option
    without its value and `InvalidValue` for an unknown language.
    """
    rest: list[str] = []
    words = iter(arguments)
    for word in words:
        name, given, value = word.partition("=")
        if word == "--":
            rest.extend(words)
        elif word == "--json":
            settings = settings._replace(json=True)
        elif name in with_value:
            settings = _with(settings, name, value if given else next(words, None), command)
        else:
            rest.append(word)
    return settings, rest


def _with(settings: OutputSettings, name: str, value: str | None, command: str) -> OutputSettings:
    if not value:
        raise InvalidCommandLine(reason=f"{name} needs a value", command=command)
    if name == "--config":
        return settings._replace(config=value)
    if value not in LANGUAGES:
        raise InvalidValue(key=name, value=value, reason=f"it is one of {', '.join(LANGUAGES)}")
    return settings._replace(language=value)
