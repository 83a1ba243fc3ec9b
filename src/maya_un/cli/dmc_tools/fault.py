"""`maya dmc fault`: faults of a running twin, which `maya up` or `maya dmc serve` runs."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from dmc41x3.address import SIM
from dmc41x3.i18n import phrase, translate
from dmc41x3.twin.wire.faults import TABLE, Value, find
from dmc41x3.twin.wire.injection import HOST
from maya_un import runtime
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.errors import InvalidCommandLine, TwinNotFound, from_notice
from maya_un.machine.faults import fault_kind
from maya_un.schema.encoding import to_data
from maya_un.schema.twin import FaultKind


class ServedTwin(NamedTuple):
    """A running virtual controller: its address, the port of its fault service, its process."""

    host: str
    port: int
    control: int
    pid: int

    @property
    def address(self) -> str:
        """The address as HOST:PORT."""
        return f"{self.host}:{self.port}"


@contextmanager
def published(twin: ServedTwin) -> Iterator[None]:
    """Publish a twin for other programs while the block runs; raises `FileUnwritable`."""
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


class FaultOrder(NamedTuple):
    """A fault to begin, with `values`, for `seconds` or until it is cleared; or with `clear`, the faults to end.

    Without a `name`, `clear` ends all faults, and an order without `clear` changes nothing.
    """

    name: str | None = None
    values: Mapping[str, Value] | None = None
    seconds: float | None = None
    clear: bool = False


class RunningTwin(NamedTuple):
    """A running twin: its address as HOST:PORT; `tell` gives it an order and returns the active faults."""

    address: str
    tell: Callable[[FaultOrder], list[dict[str, Any]]]


def chosen(address: str | None) -> RunningTwin:
    """Return the twin at HOST:PORT or PORT; for None, the only running one. Raises `TwinNotFound`."""
    twins = [*_of_the_service(), *(RunningTwin(one.address, partial(_tell_served, one)) for one in served())]
    fitting = [twin for twin in twins if address in {None, twin.address, twin.address.rpartition(":")[2]}]
    if len(fitting) == 1:
        return fitting[0]
    running = ", ".join(twin.address for twin in twins) or phrase("none")
    if address is None:
        raise TwinNotFound(reason="several run" if twins else "none runs", running=running)
    raise TwinNotFound(reason=phrase("none listens at {address}", address=address), running=running)


def _of_the_service() -> Iterator[RunningTwin]:
    """Yield the twin of the running `maya up`, if there is one."""
    client = ServiceClient.running()
    if client is not None and client.ask(requests.status())["address"] == SIM:
        yield RunningTwin(f"{client.host}:{client.port}", partial(_tell_service, client))


def _tell_service(client: ServiceClient, order: FaultOrder) -> list[dict[str, Any]]:
    active: list[dict[str, Any]] = client.ask(_request(order))["active"]
    return active


def _request(order: FaultOrder) -> Any:
    if order.clear:
        return requests.clear_faults() if order.name is None else requests.clear_fault(order.name)
    if order.name is None:
        return requests.twin_faults()
    return requests.inject_fault(order.name, values=order.values, seconds=order.seconds)


TIMEOUT = 5.0
"""Longest wait for the answer of a virtual controller [s]."""


def _tell_served(twin: ServedTwin, order: FaultOrder) -> list[dict[str, Any]]:
    answer = _answer(twin, _line(order))
    if "error" in answer:
        raise from_notice(int(answer["error"]["code"]), answer["error"]["details"])
    active: list[dict[str, Any]] = answer["active"]
    return active


def _answer(twin: ServedTwin, request: Mapping[str, object]) -> dict[str, Any]:
    try:
        with (
            socket.create_connection((HOST, twin.control), TIMEOUT) as fault_server,
            fault_server.makefile("rwb") as lines,
        ):
            lines.write(json.dumps(request).encode() + b"\n")
            lines.flush()
            answer: dict[str, Any] = json.loads(lines.readline())
    except (OSError, ValueError):
        raise TwinNotFound(
            reason=phrase("the one at {address} does not answer", address=twin.address), running=twin.address
        ) from None
    return answer


def _line(order: FaultOrder) -> Mapping[str, object]:
    if order.clear:
        return {"clear": order.name}
    return {} if order.name is None else {"fault": order.name, "values": order.values, "seconds": order.seconds}


_FAULT_COMMAND = "maya dmc fault"


def kinds(settings: OutputSettings) -> int:
    """Print every kind of fault with its parameters."""
    kinds = [fault_kind(fault, settings.language) for fault in TABLE]
    text = "\n\n".join(_fault_text(kind) for kind in kinds)
    return output.answer({"faults": [to_data(kind) for kind in kinds]}, text, settings)


def check(name: str | None, pairs: Sequence[str], seconds: float | None, *, clear: bool, active: bool) -> None:
    """Raise `InvalidCommandLine` if a part of the command line would be ignored."""
    if active and (clear or name is not None):
        raise InvalidCommandLine(reason="--active cannot be combined with --clear or NAME", command=_FAULT_COMMAND)
    if (clear or name is None) and (pairs or seconds is not None):
        raise InvalidCommandLine(
            reason="--for and PARAMETER=VALUE need NAME, and cannot be combined with --clear", command=_FAULT_COMMAND
        )


def inject(name: str, pairs: Sequence[str], seconds: float | None, twin: str | None, settings: OutputSettings) -> int:
    """Start a fault with parameters given as `name=value`, for some seconds or until cleared.

    Raises `UnknownName`, `InvalidValue`, `InvalidCommandLine`, `TwinNotFound`, `InvalidRequest`.
    """
    fault, given = find(name), [_pair(text) for text in pairs]
    if seconds is not None and fault.end is None:
        raise InvalidCommandLine(
            reason=phrase("{name} is over at once; --for is for faults that last", name=name), command=_FAULT_COMMAND
        )
    if len(given) != len(dict(given)):
        raise InvalidCommandLine(reason="a parameter is given twice", command=_FAULT_COMMAND)
    values = fault.read(dict(given))
    return _told(FaultOrder(name, values, seconds), twin, settings)


def clear(name: str | None, twin: str | None, settings: OutputSettings) -> int:
    """End all faults, or those of one name; raises `UnknownName` and `TwinNotFound`."""
    if name is not None:
        find(name)
    return _told(FaultOrder(name, clear=True), twin, settings)


def active(twin: str | None, settings: OutputSettings) -> int:
    """Print the active faults; raises `TwinNotFound`."""
    return _told(FaultOrder(), twin, settings)


def _pair(text: str) -> tuple[str, Value]:
    name, equals, value = text.partition("=")
    if not equals:
        raise InvalidCommandLine(reason=phrase("{text} is not NAME=VALUE", text=text), command=_FAULT_COMMAND)
    return name, value


def _told(order: FaultOrder, address: str | None, settings: OutputSettings) -> int:
    twin = chosen(address)
    active = twin.tell(order)
    return output.answer({"address": twin.address, "active": active}, _active_text(active, settings.language), settings)


def _active_text(active_faults: Iterable[Mapping[str, Any]], language: str) -> str:
    return "\n".join(_one_text(fault, language) for fault in active_faults) or translate(
        "No fault is active.", language
    )


def _one_text(fault: Mapping[str, Any], language: str) -> str:
    values = " ".join(f"{name}={_plain(value)}" for name, value in fault["values"].items())
    left = "" if fault["seconds"] is None else translate("for {seconds:.1f} s more", language, seconds=fault["seconds"])
    return " ".join(part for part in (fault["fault"], values, left) if part)


def _fault_text(fault: FaultKind) -> str:
    rows = [(p.name, _plain(p.default), p.unit, p.words) for p in fault.parameters]
    lines = [] if not rows else table(rows[0], rows[1:]).splitlines()
    return "\n".join([fault.name, f"  {fault.words}", *(f"    {line}" for line in lines)])


def _plain(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value)
