"""Routes of the system: readiness, status, events, metrics, recordings, audit log and backups."""

from __future__ import annotations

import asyncio
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Annotated

from fastapi import Depends, Query, Request, Response
from starlette.background import BackgroundTask
from starlette.responses import FileResponse

from dmc41x3.i18n import phrase, translate_phrase
from maya_un import __version__
from maya_un.errors import (
    EventsForgotten,
    FileUnreadable,
    FileUnwritable,
    MayaError,
    NotConnected,
    NotFound,
    ServiceNotAnswering,
    StorageDamaged,
    StorageFailed,
    TakesTooLong,
    TooLarge,
    TooMuchAsked,
    WorkerFailed,
)
from maya_un.http.bridge import Bridge
from maya_un.http.dates import now
from maya_un.http.errors import language_of
from maya_un.http.exchange import answer, as_json, sent
from maya_un.http.metrics import CONTENT_TYPE, JournalHealth, Metrics
from maya_un.http.openapi import document
from maya_un.http.request_context import Ask
from maya_un.http.routing import AT_REST, Routes
from maya_un.process.journal import history
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.recorder.recording import TimeSpan
from maya_un.schema.bodies import Texts
from maya_un.schema.encoding import MOST, to_json
from maya_un.schema.fleet import FleetView
from maya_un.schema.jobs import QueueView
from maya_un.schema.people import AuditLine
from maya_un.schema.previews import NearestLimits
from maya_un.schema.recordings import RecordedStates
from maya_un.schema.robot import (
    Addresses,
    EventMessage,
    Health,
    Kept,
    LinkView,
    MotionView,
    Readiness,
    Signals,
    Status,
    Table,
    TableView,
)
from maya_un.service.access.operations import Operation
from maya_un.service.margins import MarginSnapshot
from maya_un.service.motion import MotionSnapshot
from maya_un.service.queueing import MOST_EVENTS
from maya_un.service.service import Service
from maya_un.values import Mode, Notice

READINESS_TIMEOUT = 1.0
"""The robot is not ready if its loop does not answer within this time [s, real time]."""


async def readiness(bridge: Bridge, language: str) -> Readiness:
    """Return whether the robot is ready, or why not; waits `READINESS_TIMEOUT` at most for each of loop and disk."""
    found = [*bridge.missing()]
    try:
        async with asyncio.timeout(READINESS_TIMEOUT):
            found += await bridge.asked(_obstacles)
    except TimeoutError:
        found += [
            ServiceNotAnswering(
                reason=phrase("the robot's loop is busy for more than {seconds:g} s", seconds=READINESS_TIMEOUT)
            )
        ]
    failing = await _failing(bridge)
    if failing:
        found.append(StorageFailed(reason=failing))
    reasons = tuple(Notice(error.code, error.text(language)) for error in found)
    return Readiness(not reasons, reasons)


async def _failing(bridge: Bridge) -> str:
    """Return the reason why the journal cannot be written, "" if it can; this is tested even if no request writes."""
    if not isinstance(bridge.journal, SqliteJournal):
        return ""
    try:
        async with asyncio.timeout(READINESS_TIMEOUT):
            return await bridge.asked(lambda service: service.check_storage())
    except TimeoutError:
        return bridge.journal.failing or phrase(
            "the disk does not answer within {seconds:g} s", seconds=READINESS_TIMEOUT
        )


def storage_of(bridge: Bridge) -> JournalHealth:
    """Return the state of the journal; a journal in memory never fails."""
    journal = bridge.journal
    return JournalHealth(journal.failing, journal.commits) if isinstance(journal, SqliteJournal) else JournalHealth()


async def _obstacles(service: Service) -> list[MayaError]:
    mode = (await service.status()).state.mode
    return [NotConnected()] if mode is Mode.DISCONNECTED else []


LONGEST_WAIT = 60.0
"""Longest wait for a new event [s, real time]."""

FEW_EVENTS = 100
"""Number of events that a request gets at once; a request for more waits for its turn."""

_STATUS = "looking"


def add_reading(routes: Routes) -> None:
    """Add the routes for status, events and the parts of the twin."""

    @routes.add("GET", "/v1/status", Operation.READ, tag=_STATUS, gives=Status, client="status")
    async def status(ask: Ask) -> Response:
        """Return the present state: the machine, the running motion, the queue."""
        return answer(await ask(lambda service: service.status()))

    @routes.add("GET", "/v1/motion", Operation.READ, tag=_STATUS, gives=MotionView, client="motion")
    async def motion(ask: Ask) -> Response:
        """Return the path of the motion under way, and the step that follows the running one."""

        async def found(service: Service) -> MotionSnapshot | None:
            return service.motion()

        snapshot = await ask(found)
        return answer(MotionView() if snapshot is None else snapshot.view())

    @routes.add(
        "GET", "/v1/signals", Operation.READ, tag=_STATUS, gives=Signals, refuses=(NotConnected,), client="signals"
    )
    async def signals(ask: Ask) -> Response:
        """Return signals of the controller: following errors, motor commands, tensions, digital inputs and outputs."""

        async def found(service: Service) -> Signals:
            signals = service.signals()
            if signals is None:
                raise NotConnected
            return signals

        return answer(await ask(found))

    @routes.add("GET", "/v1/margins", Operation.READ, tag=_STATUS, gives=NearestLimits, client="margins")
    async def margins(ask: Ask) -> Response:
        """Return the limits and zones that are nearest to the robot, with their margins."""

        async def found(service: Service) -> MarginSnapshot | None:
            return service.margins()

        snapshot = await ask(found)
        return answer(NearestLimits() if snapshot is None else snapshot.view())

    @routes.add("GET", "/v1/link", Operation.READ, tag=_STATUS, gives=LinkView, client="link")
    async def link(ask: Ask) -> Response:
        """Return the quality of the link to the controller."""

        async def found(service: Service) -> LinkView:
            return service.link()

        return answer(await ask(found))

    @routes.add("GET", "/v1/events", Operation.READ, tag=_STATUS, gives=list[EventMessage], refuses=(EventsForgotten,))
    async def events(
        ask: Ask,
        since: Annotated[int, Query(ge=0, le=MOST, description="only events with a higher number")] = 0,
        wait: Annotated[
            float, Query(ge=0, le=LONGEST_WAIT, description="longest wait for an event if there is none yet [s]")
        ] = 0.0,
        run: Annotated[
            int | None, Query(ge=1, le=MOST, description="number of the run; by default the current run")
        ] = None,
        limit: Annotated[int, Query(ge=1, le=MOST_EVENTS, description="greatest number of entries")] = MOST_EVENTS,
    ) -> Response:
        """Return the events numbered above `since`, oldest first.

        If there are none, wait up to `wait` seconds for the next event.
        """
        bridge = ask.bridge
        asked = bridge.events(ask.caller, since, wait, run, min(limit, FEW_EVENTS))
        few = await (ask.while_allowed(asked, Operation.READ) if wait else asked)
        if len(few) < FEW_EVENTS or limit == FEW_EVENTS:
            return answer(few)
        async with bridge.past.turn():
            return answer(await bridge.events(ask.caller, since, 0.0, run, limit))

    @routes.add("GET", "/v1/twin", Operation.READ, tag=_STATUS, gives=Table, refuses=(NotFound,))
    async def twin(ask: Ask) -> Response:
        """Return the positions of the parts on the table of the twin [m], and the true joints (rad, m, m)."""
        return answer(await ask(lambda service: service.twin()))

    @routes.add("GET", "/v1/table", Operation.READ, tag=_STATUS, gives=TableView, client="table")
    async def table(ask: Ask) -> Response:
        """Return the parts by name with their places [m], and the part that the gripper carries.

        On a real machine they are the parts of the latest job that names any.
        """

        async def looked_at(service: Service) -> TableView:
            return service.table()

        return answer(await ask(looked_at))

    @routes.add("GET", "/v1/fleet", Operation.READ, tag=_STATUS, gives=FleetView, client="fleet")
    async def fleet(ask: Ask) -> Response:
        """Return the robots of the broker, with the steps that supervisors send them.

        A service without a broker has none: start `maya up --coms` with an MQTT broker.
        """

        async def watched(service: Service) -> FleetView:
            return service.fleet.view()

        return answer(await ask(watched))


_RECORDINGS = "recordings"
_MCAP = "application/vnd.mcap"
_CSV = "text/csv; charset=utf-8"
_READ_REFUSALS = (NotFound, FileUnreadable, TooMuchAsked, TakesTooLong, TooLarge, WorkerFailed)

_EVER = 1e9
"""No clock of a program reaches this time, nor its negative [s]."""


async def _span(
    begin: Annotated[
        float | None,
        Query(alias="from", ge=-_EVER, le=_EVER, description="from this time of the program's clock on [s]"),
    ] = None,
    end: Annotated[
        float | None, Query(alias="to", ge=-_EVER, le=_EVER, description="before this time of the program's clock [s]")
    ] = None,
) -> TimeSpan:
    return TimeSpan(-_EVER if begin is None else begin, _EVER if end is None else end)


Span = Annotated[TimeSpan, Depends(_span)]
"""The span in a request's query."""

StateRate = Annotated[
    float | None, Query(gt=0, le=1000, description="greatest number of states a second [Hz]; by default all")
]
"""The rate in a request's query."""


def add_recordings(routes: Routes) -> None:
    """Add the routes for recordings."""

    @routes.add("GET", "/v1/recordings", Operation.READ, tag=_RECORDINGS, gives=list[Kept], client="recordings.all")
    async def recordings(ask: Ask) -> Response:
        """Return the stored recordings, newest first."""

        async def listed(service: Service) -> list[Kept]:
            return service.recorder.list()

        return answer(await ask(listed))

    @routes.add(
        "POST",
        "/v1/recordings",
        Operation.RECORD,
        tag=_RECORDINGS,
        gives=Kept,
        status=201,
        refuses=(FileUnwritable,),
        client="recordings.save",
        patience=AT_REST,
    )
    async def save_recording(ask: Ask) -> Response:
        """Save the last minutes of states, events and controller traffic as a recording."""
        return answer(await ask(lambda service: service.recorder.save(ask.caller)), 201)

    @routes.add(
        "GET", "/v1/recordings/{name}", Operation.RECORD, tag=_RECORDINGS, gives=bytes, media=_MCAP, refuses=(NotFound,)
    )
    async def recording(ask: Ask, name: str) -> Response:
        """Return the file of a recording (MCAP)."""

        async def found(service: Service) -> FileResponse:
            return FileResponse(service.recorder.path(name), media_type=_MCAP, filename=name)

        return await ask(found)

    @routes.add(
        "GET",
        "/v1/recordings/{name}/states",
        Operation.READ,
        tag=_RECORDINGS,
        gives=RecordedStates,
        refuses=_READ_REFUSALS,
        client="recordings.states",
        patience=AT_REST,
    )
    async def recorded_states(ask: Ask, name: str, span: Span, rate: StateRate = None) -> Response:
        """Return the states of a recording, with the signals of the controller, as columns.

        If they are more than 20 000, it leaves out every second state, as often as necessary.
        """
        return as_json(await ask.unless_left(lambda service: service.recorder.states(name, span, rate, ask.caller)))

    @routes.add(
        "GET",
        "/v1/recordings/{name}/events",
        Operation.READ,
        tag=_RECORDINGS,
        gives=list[EventMessage],
        refuses=_READ_REFUSALS,
        client="recordings.events",
        patience=AT_REST,
    )
    async def recorded_events(ask: Ask, name: str, span: Span) -> Response:
        """Return the events of a recording, oldest first, at most 20 000."""
        return as_json(await ask.unless_left(lambda service: service.recorder.events(name, span, ask.caller)))

    @routes.add(
        "GET",
        "/v1/recordings/{name}/csv",
        Operation.READ,
        tag=_RECORDINGS,
        gives=str,
        media=_CSV,
        refuses=_READ_REFUSALS,
        client="recordings.csv",
        patience=AT_REST,
    )
    async def recorded_table(ask: Ask, name: str, span: Span, rate: StateRate = None) -> Response:
        """Return the states of a recording, with the signals of the controller, as a table (CSV)."""
        told = await ask.unless_left(lambda service: service.recorder.table(name, span, rate, ask.caller))
        file = f"{PurePath(name).stem}.csv"
        return Response(told, media_type=_CSV, headers={"Content-Disposition": f'attachment; filename="{file}"'})


_ADMIN = "keeping"
_SQLITE = "application/vnd.sqlite3"


def add_keeping(routes: Routes) -> None:
    """Add the routes for the audit log and backups."""

    @routes.add("GET", "/v1/audit", Operation.AUDIT, tag=_ADMIN, gives=list[AuditLine], client="history.audit")
    async def audit(
        ask: Ask,
        below: Annotated[int | None, Query(ge=0, le=MOST, description="only entries with a lower number")] = None,
        limit: Annotated[int, Query(ge=1, le=1000, description="greatest number of entries")] = 100,
    ) -> Response:
        """Return the audit log, newest first. With `below`, return only rows with a lower number."""
        return answer(await ask(lambda service: service.history.audit(below, limit)))

    refuses = (NotFound, FileUnwritable, StorageDamaged)

    @routes.add(
        "POST",
        "/v1/backup",
        Operation.BACKUP,
        tag=_ADMIN,
        gives=bytes,
        media=_SQLITE,
        refuses=refuses,
        patience=AT_REST,
    )
    async def back_up(ask: Ask) -> Response:
        """Return a backup of the database (SQLite): the queue, its history, the users, the audit log."""

        async def kept(_service: Service) -> Path:
            if not isinstance(ask.bridge.journal, SqliteJournal):
                raise NotFound(what="stored queue", number="with `--journal memory`")
            return ask.bridge.journal.path

        return await _copied(await ask(kept))


async def _copied(journal: Path) -> Response:
    folder = TemporaryDirectory(prefix="maya-backup-")
    copy = Path(folder.name) / journal.name
    try:
        await asyncio.get_running_loop().run_in_executor(None, history.make, journal, copy)
    except BaseException:
        folder.cleanup()
        raise
    name = f"maya-{now()[:19].replace(':', '-')}.db"
    return FileResponse(copy, media_type=_SQLITE, filename=name, background=BackgroundTask(folder.cleanup))


_SYSTEM = "server"

TextsBody = Annotated[Texts, sent(Texts)]


def add_system(routes: Routes) -> None:
    """Add the routes for health, readiness, metrics and the OpenAPI document."""

    @routes.add("GET", "/v1/health", tag=_SYSTEM, gives=Health)
    async def health() -> Response:
        """Liveness check: the server process runs. It does not check the robot."""
        return answer(Health("ok", __version__))

    @routes.add("GET", "/v1/ready", tag=_SYSTEM, gives=Readiness, also=(503,))
    async def ready(request: Request) -> Response:
        """Readiness check: return whether the robot can carry out commands, and if not, the reasons (status 503).

        It waits at most 1 s for the robot and 1 s for the disk.
        """
        found = await readiness(request.app.state.bridge, language_of(request.headers))
        return answer(found, 200 if found.ready else 503)

    @routes.add("GET", "/v1/addresses", Operation.READ, tag=_SYSTEM, gives=Addresses, client="addresses")
    async def addresses(request: Request, ask: Ask) -> Response:
        """Return the URLs at which other computers reach this service."""

        async def found(_service: Service) -> Addresses:
            return Addresses(request.app.state.addresses)

        return answer(await ask(found))

    @routes.add(
        "POST",
        "/v1/translations",
        Operation.READ,
        tag=_SYSTEM,
        gives=list[str],
        examples={"a reason": {"texts": ["it must be a number between -10 and 10"], "language": "es"}},
        client="translations",
    )
    async def translations(ask: Ask, body: TextsBody) -> Response:
        """Translate English texts of the service: messages of errors, events and jobs, reasons, remarks.

        Texts that all clients share are English. A text that the service does not know stays as it is.
        """
        found: list[str] = []
        for text in body.texts:
            async with ask.bridge.past.turn():  # a hostile text takes 16 ms
                found.append(translate_phrase(text, body.language))
        return answer(found)

    @routes.add("GET", "/metrics", Operation.READ, tag=_SYSTEM, gives=str, media=CONTENT_TYPE)
    async def prometheus(request: Request, ask: Ask) -> Response:
        """Return the metrics for Prometheus."""
        status, queue = await ask(_standing)
        metrics: Metrics = request.app.state.metrics
        return Response(metrics.text(status, queue, storage_of(ask.bridge)), media_type=CONTENT_TYPE)

    @routes.add("GET", "/v1/openapi.json", tag=_SYSTEM, gives=dict[str, object])
    async def openapi(request: Request) -> Response:
        """Return the OpenAPI document of this interface."""
        return Response(to_json(document(request.app)), media_type="application/json")


async def _standing(service: Service) -> tuple[Status, QueueView]:
    return await service.status(), service.queue.view()
