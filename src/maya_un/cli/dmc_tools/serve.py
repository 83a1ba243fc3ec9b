"""`maya dmc serve`: a virtual controller for other programs, with a record of its mechanics.

`maya dmc fault` starts and ends faults of a virtual controller that `maya dmc serve` runs.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
from collections.abc import Coroutine, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from dmc41x3.address import SIM
from dmc41x3.cli.serve import burned, require_line
from dmc41x3.cli.signals import on_end
from dmc41x3.files import open_own
from dmc41x3.i18n import phrase, translate
from dmc41x3.listening import reserve_descriptors
from dmc41x3.loops import ScaledLoop, run
from dmc41x3.twin.memory import Memory
from dmc41x3.twin.wire.faults import TABLE, Value, find
from dmc41x3.twin.wire.injection import HOST, FaultControlServer
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.twin.wire.server import bench as on_a_bench
from maya_un import runtime
from maya_un.assembly import Twin, make_twin
from maya_un.cli import output
from maya_un.cli.addresses import clock_factor
from maya_un.cli.configure import configuration, on_the_table
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.errors import FileUnwritable, InvalidCommandLine, TwinNotFound, from_notice
from maya_un.http.dates import epoch
from maya_un.machine.faults import fault_kind
from maya_un.machine.log_writer import MechanicsRecordWriter
from maya_un.machine.mechanics import SAMPLE
from maya_un.schema.encoding import to_data
from maya_un.schema.twin import FaultKind
from maya_un.values import Point


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


def chosen(address: str | None) -> ServedTwin:
    """Return the twin at HOST:PORT or PORT; for None, the only running one. Raises `TwinNotFound`."""
    twins = served()
    fitting = [twin for twin in twins if address in {None, twin.address, str(twin.port)}]
    if len(fitting) == 1:
        return fitting[0]
    running = ", ".join(twin.address for twin in twins) or phrase("none")
    if address is None:
        raise TwinNotFound(reason="several run" if twins else "none runs", running=running)
    raise TwinNotFound(reason=phrase("none listens at {address}", address=address), running=running)


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
    request: dict[str, object] = {"fault": name, "values": values, "seconds": seconds}
    return _told(request, twin, settings)


def clear(name: str | None, twin: str | None, settings: OutputSettings) -> int:
    """End all faults, or those of one name; raises `UnknownName` and `TwinNotFound`."""
    if name is not None:
        find(name)
    return _told({"clear": name}, twin, settings)


def active(twin: str | None, settings: OutputSettings) -> int:
    """Print the active faults; raises `TwinNotFound`."""
    return _told({}, twin, settings)


def _pair(text: str) -> tuple[str, Value]:
    name, equals, value = text.partition("=")
    if not equals:
        raise InvalidCommandLine(reason=phrase("{text} is not NAME=VALUE", text=text), command=_FAULT_COMMAND)
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


class LineFile:
    """A regular file to which lines are appended; `add` returns after the system call of the write."""

    def __init__(self, path: str, descriptor: int) -> None:
        self._path = path
        self._descriptor = descriptor
        self._failure: OSError | None = None

    @classmethod
    @contextmanager
    def opened(cls, path: str) -> Iterator[LineFile]:
        """Open a file while the block runs; raises `FileUnwritable`, also for a file that is not regular."""
        descriptor = open_own(Path(path), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        try:
            yield cls(path, descriptor)
        finally:
            os.close(descriptor)

    def add(self, line: str) -> None:
        """Append a line; after a failure write nothing more, so that no line is missing in between."""
        data = line.encode("utf-8")
        try:
            while data and self._failure is None:
                data = data[os.write(self._descriptor, data) :]
        except OSError as error:
            self._failure = error

    def check(self) -> None:
        """Raise `FileUnwritable` if a line could not be written."""
        if self._failure is not None:
            _refuse(self._path, self._failure.strerror or str(self._failure))


def _refuse(path: str, reason: str) -> NoReturn:
    raise FileUnwritable(path=path, reason=reason)


class TwinRecord:
    """The record of the mechanics of `twin`, written to `file`."""

    def __init__(self, twin: Twin, file: LineFile) -> None:
        self._controller = twin.controller
        self._file = file
        born = epoch() - twin.controller.machine.now
        self._chronicle = MechanicsRecordWriter(twin.mechanics, file.add, born)

    async def keep(self, period: float) -> None:
        """Record motion every `period` [s] until cancelled, and once more at the end.

        Raises `FileUnwritable` when a line cannot be written.
        """
        try:
            while True:
                self._look()
                await asyncio.sleep(period)
        finally:
            self._look()

    def _look(self) -> None:
        self._controller.look()
        self._chronicle.look()
        self._file.check()


_COMMAND = "maya dmc serve"
_MAYAS_AXES = 3


class ServeOptions(NamedTuple):
    """The options of `maya dmc serve`. `axes` and `seed` are None if they are not given."""

    host: str
    port: int
    also_ports: Sequence[int] = ()
    udp: bool = True
    axes: int | None = None
    bench: bool = False
    memory: str | None = None
    firmware: str | None = None
    speed: float | None = None
    seed: int | None = None
    table: str | None = None
    record: str | None = None


def serve(options: ServeOptions, settings: OutputSettings) -> int:
    """Serve a virtual controller until Ctrl-C or SIGTERM; prints its address when it listens.

    Raises `AddressInUse`, `FileUnwritable`, `InvalidCommandLine` and `InvalidValue`.
    """
    _check(options)
    memory = burned(options.memory)
    reserve_descriptors()
    factor = clock_factor(options.speed, SIM)
    parts = on_the_table(options.table, configuration(settings), settings)
    with nullcontext() if options.record is None else LineFile.opened(options.record) as record:
        run(_serve(options, memory, parts, record, factor, settings), lambda: ScaledLoop(factor))
    return output.DONE


def _check(options: ServeOptions) -> None:
    if options.axes not in {None, _MAYAS_AXES} and not options.bench:
        raise InvalidCommandLine(reason="Maya has three axes; --axes is for --bench", command=_COMMAND)
    if options.bench and options.table is not None:
        raise InvalidCommandLine(reason="there is no table on a bench", command=_COMMAND)
    if options.bench and options.record is not None:
        raise InvalidCommandLine(reason="a bench has no mechanics to record", command=_COMMAND)
    require_line(options.firmware)


def _made(options: ServeOptions, parts: dict[str, Point], memory: Memory) -> VirtualController | Twin:
    if not options.bench:
        return make_twin(seed=options.seed or 0, parts=parts, memory=memory, firmware=options.firmware)
    return on_a_bench(options.axes or _MAYAS_AXES, memory, options.firmware, options.seed or 0)


async def _serve(
    options: ServeOptions,
    memory: Memory,
    parts: dict[str, Point],
    record: LineFile | None,
    speed: float,
    settings: OutputSettings,
) -> None:
    made = _made(options, parts, memory)
    controller = made.controller if isinstance(made, Twin) else made
    kept = TwinRecord(made, record) if record is not None and isinstance(made, Twin) else None
    fault_server: FaultControlServer | None = None
    try:
        host, port = await controller.serve(options.host, options.port, udp=options.udp)
        for also in options.also_ports:
            await controller.serve(options.host, also, udp=options.udp)
        fault_server = await FaultControlServer.opened(controller.faults)
        asked = asyncio.Event()
        end = on_end(asked.set, signal.SIGINT, signal.SIGTERM)
        with end, published(ServedTwin(host, port, fault_server.port, os.getpid())):
            _say(host, port, fault_server.port, options, settings)
            if kept is None:
                await asked.wait()
            else:
                await _until(asked, kept.keep(SAMPLE * max(1.0, speed)))
    finally:
        if fault_server is not None:
            await fault_server.close()
        await controller.close()


async def _until(asked: asyncio.Event, work: Coroutine[None, None, None]) -> None:
    """Wait for `asked` while `work` runs; raises what `work` raises."""
    waiting, working = asyncio.create_task(asked.wait()), asyncio.create_task(work)
    try:
        await asyncio.wait((waiting, working), return_when=asyncio.FIRST_COMPLETED)
    finally:
        waiting.cancel()
        working.cancel()
        await asyncio.wait((waiting, working))
    if not working.cancelled():
        working.result()


def _say(host: str, port: int, control: int, options: ServeOptions, settings: OutputSettings) -> None:
    address = f"{host}:{port}"
    also = [f"{host}:{also}" for also in options.also_ports]
    value = {"address": address, "also": also, "udp": options.udp, "control": control, "pid": os.getpid()}
    output.answer(value, f"{address}\nmaya dmc fault: {HOST}:{control}", settings)
