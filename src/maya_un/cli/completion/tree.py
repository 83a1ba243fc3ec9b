"""The commands for shell completion, from the parser's table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

FILES, JOBS, PLACES = "@files", "@jobs", "@places"
"""Kinds of variable values: file names, job numbers, names of taught places."""

EVERYWHERE = {"--json": "", "--lang": "en es", "--units": "mm si", "--config": FILES, "--help": ""}
"""Options of every command, with the kind of their values, "" for none."""

_FILES = {"FILE", "[FILE]", "SCRIPT", "OUT", "JOB"}
_PLACES = {"NAME|X", "NAME|A", "[POSE]..."}
_ADDRESSES = {"HOST", "[HOST]", "HOST[:PORT]", "WHERE"}


class CompletionOption(NamedTuple):
    """An option: whether it takes a value, and which: words, or one of the kinds above, "" if unknown."""

    name: str
    valued: bool
    values: str
    about: str


class CompletionCommand(NamedTuple):
    """A command by its path, like "maya job show", and its completions; `arguments` has the values of each argument."""

    path: str
    about: str
    commands: tuple[tuple[str, str], ...]
    options: tuple[CompletionOption, ...]
    arguments: tuple[str, ...]


def commands(root: Any) -> list[CompletionCommand]:
    """Return the root command of the parser and all commands below it."""
    return list(_walk(root, "maya"))


def _walk(command: Any, path: str) -> Iterator[CompletionCommand]:
    below: dict[str, Any] = {name: one for name, one in getattr(command, "commands", {}).items() if not one.hidden}
    named = dict(_hurried()) if path == "maya" else {}
    named |= {name: _about(one) for name, one in below.items()}
    options = [option for one in command.params if one.param_type_name == "option" for option in _options(one)]
    options += [CompletionOption(name, bool(values), values, "") for name, values in EVERYWHERE.items()]
    arguments = [_values(one, path) for one in command.params if one.param_type_name == "argument"]
    yield CompletionCommand(
        path, _about(command), tuple(sorted(named.items())), tuple(dict.fromkeys(options)), tuple(arguments)
    )
    if path == "maya":
        stop = CompletionOption("--address", valued=True, values="real", about="stop the controller directly")
        common = tuple(option for option in options if option.name in EVERYWHERE)
        yield CompletionCommand("maya status", named["status"], (), common, ())
        yield CompletionCommand("maya stop", named["stop"], (), (stop, *common), ())
    for name, one in below.items():
        yield from _walk(one, f"{path} {name}")


def _hurried() -> Iterator[tuple[str, str]]:
    """Yield the commands that bypass the parser."""
    yield "status", "Tell what the running robot is doing."
    yield "stop", "Stop the running robot: it decelerates along the path."


def _about(command: Any) -> str:
    """Return the first sentence of a command's help."""
    lines = (command.help or "").strip().splitlines() or [""]
    return str(lines[0]).strip()


def _options(parameter: Any) -> Iterator[CompletionOption]:
    about = str(parameter.help or "")
    for name in (*parameter.opts, *parameter.secondary_opts):
        if name.startswith("--") and name not in EVERYWHERE:
            yield CompletionOption(
                name, not parameter.is_flag, "" if parameter.is_flag else _values(parameter, name), about
            )


def _values(parameter: Any, where: str) -> str:
    """Return the values of a parameter or option by its type and metavar."""
    choices = getattr(parameter.type, "choices", None)
    if choices:
        return " ".join(str(choice) for choice in choices)
    metavar = parameter.metavar or ""
    whole = parameter.type.name.startswith("int")
    if whole and metavar.strip("[]") in {"JOB", "OTHER"}:
        return JOBS
    if where == "--address" or metavar in _ADDRESSES:
        return "sim real"
    if metavar in _PLACES or where in {"maya poses remove", "maya poses rename"}:
        return PLACES
    return FILES if metavar in _FILES and not whole else ""
