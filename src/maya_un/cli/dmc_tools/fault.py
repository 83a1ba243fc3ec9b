"""`maya dmc fault`: start and end faults of a virtual controller that `maya dmc serve` runs."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from dmc41x3.i18n import translate
from dmc41x3.twin.wire.faults import TABLE, Fault, Parameter, Value, find
from dmc41x3.twin.wire.injection import HOST
from maya_un import runtime
from maya_un.cli import output
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.errors import InvalidCommandLine, TwinNotFound, from_notice


class ServedTwin(NamedTuple):
    """A virtual controller that runs: where it listens, the port of its door for faults, its process."""

    host: str
    port: int
    control: int
    pid: int

    @property
    def address(self) -> str:
        """Where it listens, as people write it."""
        return f"{self.host}:{self.port}"


@contextmanager
def published(twin: ServedTwin) -> Iterator[None]:
    """Let others find a twin while the block runs; raises `FileUnwritable`."""
    name = _name(twin.pid)
    runtime.write(name, twin._asdict())
    try:
        yield
    finally:
        with suppress(OSError):
            (runtime.folder() / name).unlink()


def served() -> list[ServedTwin]:
    """Return the twins whose process still runs, by address."""
    return sorted(twin for path in runtime.folder().glob(_name("*")) if (twin := _read(path)) is not None)


def chosen(address: str | None) -> ServedTwin:
    """Return the twin at HOST:PORT or at PORT, with None the only one; raises `TwinNotFound`."""
    twins = served()
    fitting = [twin for twin in twins if address in {None, twin.address, str(twin.port)}]
    if len(fitting) == 1:
        return fitting[0]
    running = ", ".join(twin.address for twin in twins) or "none"
    unnamed = "several run" if twins else "none runs"
    raise TwinNotFound(reason=unnamed if address is None else f"none listens at {address}", running=running)


def _name(pid: int | str) -> str:
    return f"twin-{pid}.json"


def _read(path: Path) -> ServedTwin | None:
    found = runtime.read(path)
    try:
        twin = ServedTwin(str(found["host"]), int(found["port"]), int(found["control"]), int(found["pid"]))
        os.kill(twin.pid, 0)
    except (KeyError, TypeError, ValueError, OSError):
        return None
    return twin


TIMEOUT = 5.0
"""Longest wait for the answer of a virtual controller [s]."""

_COMMAND = "maya dmc fault"


def kinds(settings: OutputSettings) -> int:
    """Print every kind of fault with its parameters."""
    text = "\n\n".join(_fault_text(fault) for fault in TABLE)
    return output.answer({"faults": [_fault_data(fault) for fault in TABLE]}, text, settings)


def check(name: str | None, pairs: Sequence[str], seconds: float | None, *, clear: bool, active: bool) -> None:
    """Raise `InvalidCommandLine` where a part of the command line would not be heeded."""
    if active and (clear or name is not None):
        raise InvalidCommandLine(reason="--active goes with neither --clear nor a name", command=_COMMAND)
    if (clear or name is None) and (pairs or seconds is not None):
        raise InvalidCommandLine(reason="--for and parameters are for a fault that begins", command=_COMMAND)


def inject(name: str, pairs: Sequence[str], seconds: float | None, twin: str | None, settings: OutputSettings) -> int:
    """Begin a fault with parameters given as `name=value`, for some seconds or until cleared.

    Raises `UnknownName`, `InvalidValue`, `InvalidCommandLine`, `TwinNotFound`, `InvalidRequest`.
    """
    fault, given = find(name), [_pair(text) for text in pairs]
    if seconds is not None and fault.end is None:
        raise InvalidCommandLine(reason=f"{name} is over at once; --for is for faults that last", command=_COMMAND)
    if len(given) != len(dict(given)):
        raise InvalidCommandLine(reason="a parameter is given twice", command=_COMMAND)
    values = fault.read(dict(given))
    request: dict[str, object] = {"fault": name, "values": values, "seconds": seconds}
    return _told(request, twin, settings)


def clear(name: str | None, twin: str | None, settings: OutputSettings) -> int:
    """End all faults, or those of one name; raises `UnknownName` and `TwinNotFound`."""
    if name is not None:
        find(name)
    return _told({"clear": name}, twin, settings)


def active(twin: str | None, settings: OutputSettings) -> int:
    """Print the faults that last; raises `TwinNotFound`."""
    return _told({}, twin, settings)


def _pair(text: str) -> tuple[str, Value]:
    name, equals, value = text.partition("=")
    if not equals:
        raise InvalidCommandLine(reason=f"{text} is not NAME=VALUE", command=_COMMAND)
    return name, value


def _told(request: Mapping[str, object], address: str | None, settings: OutputSettings) -> int:
    twin = chosen(address)
    answer = _asked(twin, request)
    if "error" in answer:
        raise from_notice(int(answer["error"]["code"]), answer["error"]["details"])
    value = {"address": twin.address, "active": answer["active"]}
    return output.answer(value, _active_text(answer["active"], settings.language), settings)


def _asked(twin: ServedTwin, request: Mapping[str, object]) -> dict[str, Any]:
    try:
        with socket.create_connection((HOST, twin.control), TIMEOUT) as door, door.makefile("rwb") as lines:
            lines.write(json.dumps(request).encode() + b"\n")
            lines.flush()
            answer: dict[str, Any] = json.loads(lines.readline())
    except (OSError, ValueError):
        raise TwinNotFound(reason=f"the one at {twin.address} does not answer", running=twin.address) from None
    return answer


def _active_text(active_faults: Iterable[Mapping[str, Any]], language: str) -> str:
    return "\n".join(_one_text(fault, language) for fault in active_faults) or translate(
        "No fault is active.", language
    )


def _one_text(fault: Mapping[str, Any], language: str) -> str:
    values = " ".join(f"{name}={_plain(value)}" for name, value in fault["values"].items())
    left = "" if fault["seconds"] is None else translate("for {seconds:.1f} s more", language, seconds=fault["seconds"])
    return " ".join(part for part in (fault["fault"], values, left) if part)


def _fault_text(fault: Fault) -> str:
    rows = [(p.name, _plain(p.default), p.unit, p.words) for p in fault.parameters]
    lines = [] if not rows else table(rows[0], rows[1:]).splitlines()
    return "\n".join([fault.name, f"  {fault.words}", *(f"    {line}" for line in lines)])


def _fault_data(fault: Fault) -> dict[str, object]:
    parameters = [_parameter_data(parameter) for parameter in fault.parameters]
    return {"name": fault.name, "words": fault.words, "lasts": fault.end is not None, "parameters": parameters}


def _parameter_data(parameter: Parameter) -> dict[str, object]:
    return {"name": parameter.name, "default": parameter.default, "unit": parameter.unit, "words": parameter.words}


def _plain(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value)
