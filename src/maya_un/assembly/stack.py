"""All layers of a robot in one program: the process layer and its service on the controller layer."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dmc41x3.address import SIM
from maya_un.assembly.controller import Twin, controller_layer
from maya_un.cancellation import run_to_end
from maya_un.config import Config, StorageConfig
from maya_un.controller.controller import GalilController
from maya_un.controller.protocol import Controller
from maya_un.events import Event, EventLog
from maya_un.process.journal.protocol import EventRow, Journal
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.process.lease import ControlLease
from maya_un.process.process import Process
from maya_un.process.spec.poses import PoseStore
from maya_un.recorder.recorder import Recorder
from maya_un.recorder.store import RecordingStore
from maya_un.robot.robot import MayaRobot, Robot
from maya_un.schema.robot import plain
from maya_un.service.access.control import AccessControl
from maya_un.service.access.users import Calendar, FileStore, Store
from maya_un.service.service import Gate, Service, TwinParts
from maya_un.service.twin import FaultInjector
from maya_un.values import Point
from maya_un.workers import WorkerSet

if TYPE_CHECKING:
    from maya_un.machine.truth import TrueConstants


@dataclass(frozen=True, slots=True)
class ProcessAssembly:
    """The process layer on some robot.

    Interfaces for other users call `service` through the `gate`, and identify their callers by `access`.
    """

    process: Process
    service: Service
    gate: Gate
    access: AccessControl
    lease: ControlLease
    journal: Journal


class StackStorage(NamedTuple):
    """Data that outlives a program: the queue's journal, and the users; None if it is not stored."""

    journal: Journal | None
    users: Store | None


@dataclass(frozen=True, slots=True)
class Stack(ProcessAssembly):
    """All layers of one robot: the process layer, and the layers below it. `twin` is None on a real machine."""

    config: Config
    address: str
    controller: GalilController
    robot: MayaRobot
    twin: Twin | None


@asynccontextmanager
async def stack(  # noqa: PLR0913 - every option of a stack is a parameter
    config: Config,
    address: str = SIM,
    *,
    seed: int = 0,
    parts: Mapping[str, Point] | None = None,
    truth: TrueConstants | None = None,
    live: bool = True,
    skip_home: bool = False,
    take_over: bool = False,
    speed: float = 1.0,
    places: Path | None = None,
    config_file: Path | None = None,
    journal: Journal | None = None,
    calendar: Calendar | None = None,
    users: Store | None = None,
    recordings: RecordingStore | None = None,
    staff: WorkerSet | None = None,
) -> AsyncIterator[Stack]:
    """Connect all layers on the controller at `address` for the length of the block.

    The address is "sim", "real", HOST[:PORT] or a serial port.
    `speed` is the speed of the loop's clock, which the service reports; it changes nothing here. The file at `places`
    stores taught places; without one they last as long as the stack. Points of a calibration are stored beside it.
    Clients change `config_file` for the next start, if it is given. `journal` stores the queue and its history, the
    events and the audit log; its opener closes it. Its unfinished jobs wait for a user. `calendar` returns dates,
    `users` stores who may sign in. If `recordings` is given, a live stack is recorded. With a `staff` no motion is
    planned in the running loop. A controller that another program owns is refused; with `take_over` it is claimed at
    rest. Raises the errors of connecting (`ConnectFailed`, `LinkTimeout`, `WrongController`, `ControllerOwned`,
    `ControllerMoves`, `ParameterMismatch`, `GuardBlocked`), and `MarkerMissing` if `skip_home` finds no mark.
    """
    async with controller_layer(
        config,
        address,
        seed=seed,
        parts=parts,
        truth=truth,
        live=live,
        skip_home=skip_home,
        take_over=take_over,
        speed=speed,
        recordings=recordings,
        workers=None if staff is None else staff.own,
        heard=partial(_number_run, journal, calendar),
    ) as below:
        if staff is not None:
            staff.own.warm()
        robot = MayaRobot(below.controller, config, None if staff is None else staff.own)
        async with process_layer(
            robot,
            below.controller,
            config,
            address=below.address,
            speed=speed,
            places=places,
            config_file=config_file,
            journal=journal,
            calendar=calendar,
            users=users,
            recorder=below.recorder,
            staff=staff,
            twin=below.twin,
            faults=None if below.twin is None else below.twin.faults,
        ) as above:
            yield Stack(
                above.process,
                above.service,
                above.gate,
                above.access,
                above.lease,
                above.journal,
                config,
                below.address,
                below.controller,
                robot,
                below.twin,
            )


@asynccontextmanager
async def process_layer(  # noqa: PLR0913 - every option of a process layer is a parameter
    robot: Robot,
    controller: Controller,
    config: Config,
    *,
    address: str = SIM,
    speed: float = 1.0,
    places: Path | None = None,
    config_file: Path | None = None,
    journal: Journal | None = None,
    calendar: Calendar | None = None,
    users: Store | None = None,
    recorder: Recorder | None = None,
    staff: WorkerSet | None = None,
    twin: TwinParts | None = None,
    faults: FaultInjector | None = None,
) -> AsyncIterator[ProcessAssembly]:
    """Connect the process layer and its service to any robot and controller for the length of the block.

    They may run in this process or at the other end of a graph. `twin` has the parts of a twin in this process, and
    `faults` injects its faults. The other parameters are as in `stack`. Raises `StorageFailed` if the journal's
    unfinished jobs cannot be restored.
    """
    store = PoseStore(controller.mechanism, places)
    lease = ControlLease(controller.events, speed)
    dates = None if calendar is None else calendar.after
    process = Process(
        robot,
        controller,
        config,
        store.taught,
        journal=journal,
        lease=lease,
        dates=dates,
        speed=speed,
        staff=staff,
    )
    note = process.journal.note
    access = AccessControl.new(lease, store=users, calendar=calendar, note=note, speed=speed)
    try:
        await access.register.open()
        await process.open()
        service = Service(
            process,
            robot,
            controller,
            config,
            address=address,
            speed=speed,
            store=store,
            access=access,
            recorder=recorder,
            workers=None if staff is None else staff.people,
            twin=twin,
            config_file=config_file,
            faults=faults,
            measured_points=None if places is None else places.with_name("calibration.csv"),
        )
        gate = Gate(service, lease, access.audit.asked, access.callers.current)
        yield ProcessAssembly(process, service, gate, access, lease, process.journal)
    finally:
        await run_to_end(process.close())
        await access.register.close()
        lease.close()


@asynccontextmanager
async def storage(path: Path | None, keep: StorageConfig) -> AsyncIterator[StackStorage]:
    """Open the data that outlives this program, and close it last; without a `path` there is none.

    Raises `StorageInUse`, `StorageDamaged`, `StorageTooNew`, `FileNotOurs`, `FileUnwritable`, `StorageUnavailable`.
    """
    if path is None:
        yield StackStorage(None, None)
        return
    journal = await SqliteJournal.open(path, keep)
    try:
        yield StackStorage(journal, FileStore(path))
    finally:
        await journal.close()


def _number_run(journal: Journal | None, calendar: Calendar | None, events: EventLog) -> None:
    """Number this run of the program, and store its events if there is a journal.

    Only a journal counts the starts. Without one, the number consists of the digits of the date, if there is a
    calendar: clients must notice that the service was started again.
    """
    if journal is not None:
        keep_events(events, journal, calendar)
    elif calendar is not None:
        events.run = int("".join(filter(str.isdigit, calendar.now()[:19])))


def keep_events(events: EventLog, journal: Journal, calendar: Calendar | None) -> None:
    """Store every event in a journal, under the number of this run."""
    events.run = journal.run

    def keep(event: Event) -> None:
        date = "" if calendar is None else calendar.now()
        detail = {key: plain(value) for key, value in event.detail.items()}
        journal.note(EventRow(journal.run, event.seq, date, event.time, event.kind, event.code, detail))

    events.heard_by(keep)
