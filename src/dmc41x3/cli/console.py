"""The command line of every tool: its options, its environment, its output and its exit codes.

This module imports nothing heavy, because `maya` loads it at every start.

`dmc` uses `Alone`; a program built on this package defines its own `Site`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from io import TextIOWrapper
from itertools import takewhile
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

from dmc41x3.address import REAL, ControllerAddress, is_serial, parse
from dmc41x3.errors import CodedError, InvalidCommandLine, InvalidValue
from dmc41x3.i18n import LANGUAGES, phrase, visible

if TYPE_CHECKING:
    from pathlib import Path

    from dmc41x3.driver import Driver
    from dmc41x3.twin.wire.server import VirtualController

FASTEST = 1000.0
"""Largest factor of the twin's clock."""


def clock_factor(speed: float | None) -> float:
    """Return the factor of the twin's clock against real time; None means 1.

    Raises `InvalidValue` outside 0 < speed ≤ 1000.
    """
    if speed is None:
        return 1.0
    if not 0.0 < speed <= FASTEST:
        raise InvalidValue(
            key="--speed", value=speed, reason=phrase("it must be above 0 and at most {most:g}", most=FASTEST)
        )
    return speed


def controller_address(text: str, key: str = "--address", words: str = REAL) -> ControllerAddress:
    """Return the place that HOST, HOST:PORT or a serial port names.

    Raises `InvalidValue`, whose text also names the other accepted `words`, except for a serial port.
    """
    try:
        return parse(text)
    except ValueError as error:
        reason = str(error)
        if not is_serial(text):
            reason = phrase("where it is not {words}, {error}", words=words, error=error)
        raise InvalidValue(key=key, value=repr(text), reason=reason) from error


ADDRESS = "DMC_ADDRESS"
"""The environment variable that names the controller for `real`."""


class Site(Protocol):
    """The facts that the tools need from the program that contains them."""

    @property
    def command(self) -> str:
        """The words before the name of a tool on the command line."""
        ...

    @property
    def real(self) -> str:
        """The meaning of the address `real`, for the help of the tools."""
        ...

    def meant(self, address: str, config: str | None) -> str:
        """Return `address`, or the address of the configured controller for `real`.

        `config` is the configuration file named on the command line. Raises `InvalidValue`, `InvalidConfig`.
        """
        ...

    def twin(self) -> VirtualController:
        """Return a new twin for the address `sim`, in the running loop."""
        ...

    async def require_free(self, driver: Driver, address: str) -> None:
        """Raise `ControllerOwned` if the controller belongs to another program that still runs."""
        ...

    def history(self) -> Path:
        """Return the file for the history of the terminal."""
        ...


class Alone:
    """The site of the command `dmc`: the twin is a bench, and no program owns a controller."""

    command = "dmc"
    real = f"the controller at ${ADDRESS}"

    def meant(self, address: str, config: str | None) -> str:
        """Return `address`, or for `real` the one in $DMC_ADDRESS; raises `InvalidValue` if that is not set."""
        del config
        if address != REAL:
            return address
        named = os.environ.get(ADDRESS, "")
        if not named:
            raise InvalidValue(
                key="HOST", value=repr(REAL), reason=phrase("${variable} does not name a controller", variable=ADDRESS)
            )
        return named

    def twin(self) -> VirtualController:
        """Return a DMC-4133 with three servo motors on a bench."""
        from dmc41x3.twin.wire.server import bench

        return bench(3)

    async def require_free(self, driver: Driver, address: str) -> None:
        """Accept every controller."""

    def history(self) -> Path:
        """Return a file in $XDG_STATE_HOME."""
        from pathlib import Path

        state = os.environ.get("XDG_STATE_HOME", "")
        return (Path(state) if state else Path.home() / ".local" / "state") / "dmc41x3" / "history"


ALONE = Alone()
"""The site of every command of `dmc`."""


UNITS = ("mm", "si")
"""Millimetres and degrees, or metres and radians."""


class OutputSettings(NamedTuple):
    """Format of the output: language, and JSON or sentences; `site` supplies the environment.

    `config` is the configuration file named on the command line, None without one. `units` are those of lengths and
    angles, one of `UNITS`. `dmc` has neither option.
    """

    language: str = "en"
    json: bool = False
    config: str | None = None
    site: Site = ALONE
    units: str = UNITS[0]


class CommandContext(Protocol):
    """A command's context, which carries the settings of the command line."""

    obj: Any


def settings_of(context: CommandContext) -> OutputSettings:
    """Return the settings of the whole command line."""
    settings = context.obj
    assert isinstance(settings, OutputSettings)
    return settings


def from_environment(variable: str = "DMC_LANG") -> OutputSettings:
    """Return the default settings: the language in `variable`, or English if that is not available."""
    wanted = os.environ.get(variable, "en")[:2].lower()
    return OutputSettings(language=wanted if wanted in LANGUAGES else "en")


def asks_for_json(arguments: Sequence[str]) -> bool:
    """Return whether the command line requests JSON, even if the rest of it is not valid."""
    return "--json" in takewhile(lambda word: word != "--", arguments)


def split_options(
    arguments: Sequence[str],
    settings: OutputSettings,
    command: str = "dmc",
    with_value: Sequence[str] = ("--lang",),
) -> tuple[OutputSettings, list[str]]:
    """Take the global options out of `arguments`; return the settings and the other arguments, in order.

    `with_value` lists which of --lang, --units and --config `command` has. Raises `InvalidCommandLine` for an option
    without its value and `InvalidValue` for an unknown language or unit system.
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
        raise InvalidCommandLine(reason=phrase("{name} needs a value", name=name), command=command)
    if name == "--config":
        return settings._replace(config=value)
    known = UNITS if name == "--units" else LANGUAGES
    if value not in known:
        raise InvalidValue(
            key=name, value=value, reason=phrase("it must be one of {choices}", choices=", ".join(known))
        )
    return settings._replace(units=value) if name == "--units" else settings._replace(language=value)


DONE = 0
"""The command did everything requested."""

FAILED = 1
"""The command was valid but failed, or did not finish."""

REFUSED = 2
"""The command line, a value, a file or the configuration is wrong; nothing was tried."""

INTERRUPTED = 130
"""Ctrl-C ended the command; motion stopped on its path."""


def tolerate_any_terminal() -> None:
    """Replace characters that the terminal cannot encode or decode, instead of failing.

    If there is no standard input, as under a service manager, reading finds the end of a file.
    """
    if cast("object", sys.stdin) is None:
        from pathlib import Path

        sys.stdin = Path(os.devnull).open(encoding="utf-8")  # noqa: SIM115 - for as long as the process lives
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")


def say(text: str) -> None:
    """Print one line for people, in one piece, so that a reader never sees half of it."""
    _print(f"{text}\n")


def typed(question: str) -> str:
    """Return the line that a person types, without surrounding blanks; the end of the input is an empty line."""
    try:
        return input(question).strip()
    except EOFError:
        say("")
        return ""


def emit(value: object) -> None:
    """Print `value` as JSON; its keys are stable."""
    import json

    _print(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False, default=str) + "\n")


def _print(text: str) -> None:
    """Print; raises `FileUnwritable`, and `BrokenPipeError` if the reader is gone."""
    try:
        print(text, end="", flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        from dmc41x3.files import unwritable

        raise unwritable("stdout", error) from error


def forget_unprinted() -> None:
    """Drop unprinted output if the reader is gone; otherwise the interpreter reports it again at its end."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def answer(value: Mapping[str, object], text: str, settings: OutputSettings) -> int:
    """Print an answer as JSON (`value`) or as `text`, according to the settings; return the exit code of success."""
    if settings.json:
        emit(value)
    else:
        say(text)
    return DONE


def complain(error: CodedError, settings: OutputSettings, program: str = "dmc") -> int:
    """Print an error of `program`, one sentence with its code (or JSON), and return its exit code.

    If JSON cannot be printed, the sentence goes to standard error.
    """
    try:
        _print_error(error, settings, program)
    except BrokenPipeError:
        pass  # the reader is gone; only the exit code remains
    except CodedError:
        _print_error(error, settings._replace(json=False), program)
    return exit_code(error.code)


def _print_error(error: CodedError, settings: OutputSettings, program: str) -> None:
    text = error.text(settings.language)
    if settings.json:
        details = {key: _plain(value) for key, value in error.details.items()}
        emit({"error": {"code": error.code, "message": text, "details": details}})
    else:
        with suppress(OSError):  # standard error is not writable
            print(visible(f"{program}: error {error.code}: {text}"), file=sys.stderr, flush=True)


def exit_code(code: int) -> int:
    """Return the exit code of an error's code: 2 for wrong requests and files (4xxx, 5xxx), else 1."""
    return REFUSED if 4000 <= code < 5999 else FAILED


def _plain(value: object) -> object:
    """Return a detail as it is if JSON can encode it, else as text."""
    import json

    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError):
        return str(value)
    return value
