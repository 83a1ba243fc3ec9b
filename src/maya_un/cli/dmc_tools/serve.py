"""`maya dmc serve`: a virtual controller for other programs, with a record of its mechanics."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import NamedTuple, NoReturn

from dmc41x3.address import SIM
from dmc41x3.cli.serve import bootp_server, burned, require_line
from dmc41x3.cli.signals import on_end
from dmc41x3.files import open_own
from dmc41x3.listening import reserve_descriptors
from dmc41x3.loops import ScaledLoop, run
from dmc41x3.twin.memory import Memory
from dmc41x3.twin.wire.injection import HOST, FaultControlServer
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.twin.wire.server import bench as on_a_bench
from maya_un.assembly.controller import Twin, make_twin
from maya_un.cli import output
from maya_un.cli.addresses import clock_factor
from maya_un.cli.configure import configuration, on_the_table, truth_of_twin
from maya_un.cli.dmc_tools.fault import ServedTwin, published
from maya_un.cli.settings import OutputSettings
from maya_un.errors import FileUnwritable, InvalidCommandLine
from maya_un.http.dates import epoch
from maya_un.machine.log_writer import MechanicsRecordWriter
from maya_un.machine.mechanics import SAMPLE


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
    """The options of `maya dmc serve`. `axes` and `seed` are None if they are not given.

    `truth` is as in `configure.truth_of_twin`.
    """

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
    truth: str | None = None
    table: str | None = None
    record: str | None = None
    serial: bool = False
    bootp: str | None = None


def serve(options: ServeOptions, settings: OutputSettings) -> int:
    """Serve a virtual controller until Ctrl-C or SIGTERM; prints its address when it listens.

    Raises `AddressInUse`, `FileUnwritable`, `InvalidCommandLine` and `InvalidValue`.
    """
    _check(options)
    memory = burned(options.memory)
    reserve_descriptors()
    factor = clock_factor(options.speed, SIM)
    machine = _bench(options, memory) if options.bench else _machine(options, memory, settings)
    with nullcontext() if options.record is None else LineFile.opened(options.record) as record:
        run(_serve(options, machine, record, factor, settings), lambda: ScaledLoop(factor))
    return output.DONE


def _check(options: ServeOptions) -> None:
    if options.axes not in {None, _MAYAS_AXES} and not options.bench:
        raise InvalidCommandLine(reason="Maya has three axes; --axes is for --bench", command=_COMMAND)
    if options.bench and options.table is not None:
        raise InvalidCommandLine(reason="there is no table on a bench", command=_COMMAND)
    if options.bench and options.truth is not None:
        raise InvalidCommandLine(reason="--truth is for the robot, not for a bench", command=_COMMAND)
    if options.bench and options.record is not None:
        raise InvalidCommandLine(reason="a bench has no mechanics to record", command=_COMMAND)
    require_line(options.firmware)


Make = Callable[[], VirtualController | Twin]
"""Makes a virtual controller in the running loop."""


def _bench(options: ServeOptions, memory: Memory) -> Make:
    return partial(on_a_bench, options.axes or _MAYAS_AXES, memory, options.firmware, options.seed or 0)


def _machine(options: ServeOptions, memory: Memory, settings: OutputSettings) -> Make:
    """Return what makes the twin; raises the errors of its files."""
    config, seed = configuration(settings), options.seed or 0
    return partial(
        make_twin,
        config,
        seed=seed,
        truth=truth_of_twin(options.truth, config, seed),
        parts=on_the_table(options.table, config, settings),
        memory=memory,
        firmware=options.firmware,
    )


async def _serve(
    options: ServeOptions,
    make: Make,
    record: LineFile | None,
    speed: float,
    settings: OutputSettings,
) -> None:
    made = make()
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
            serial = controller.serve_serial() if options.serial else None
            if options.bootp is not None:
                controller.ask_for_address(bootp_server(options.bootp))
            _say(host, port, fault_server.port, serial, options, settings)
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


def _say(
    host: str, port: int, control: int, serial: str | None, options: ServeOptions, settings: OutputSettings
) -> None:
    address = f"{host}:{port}"
    also = [f"{host}:{also}" for also in options.also_ports]
    value = {
        "address": address,
        "also": also,
        "udp": options.udp,
        "serial": serial,
        "control": control,
        "pid": os.getpid(),
    }
    lines = filter(None, (address, serial, f"maya dmc fault: {HOST}:{control}"))
    output.answer(value, "\n".join(lines), settings)
