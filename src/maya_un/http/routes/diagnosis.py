"""Routes by which users find out what is wrong: the log, the checks of `maya doctor`, a terminal, a scope."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Annotated, Any

from fastapi import Query, Response

from maya_un.config import Config
from maya_un.errors import FileUnreadable, InvalidValue, NotConnected, NotOverRos, TerminalReadsOnly, UnknownName
from maya_un.http.doctor import host
from maya_un.http.doctor import robot as doctor_robot
from maya_un.http.doctor.finding import Finding, guarded
from maya_un.http.doctor.words import message
from maya_un.http.exchange import answer, sent
from maya_un.http.log import log_path, written_down
from maya_un.http.log_reader import MOST_ENTRIES, newest, utc
from maya_un.http.request_context import Ask
from maya_un.http.routes.system import readiness
from maya_un.http.routing import AT_REST, Routes
from maya_un.schema.bodies import ControllerCommand
from maya_un.schema.choices import LogLevel
from maya_un.schema.diagnosis import Diagnosis, LogEntry
from maya_un.schema.encoding import to_data
from maya_un.schema.recordings import ScopeView
from maya_un.schema.robot import TerminalReply
from maya_un.service.access.operations import Caller, Operation
from maya_un.service.service import Service

CommandBody = Annotated[ControllerCommand, sent(ControllerCommand)]

_DIAGNOSIS = "diagnosis"
_SIGNAL = "a column besides the time; may be repeated, by default all"

LONGEST_SCOPE = 300.0
"""Longest duration of one answer [s]."""

_DATE = "only entries from this date on (ISO 8601); without a zone it is in the local time of the service"


def add_diagnosis(routes: Routes) -> None:
    """Add the routes for the log, the checks, the terminal and the scope."""

    @routes.add(
        "GET",
        "/v1/logs",
        Operation.DIAGNOSE,
        tag=_DIAGNOSIS,
        gives=list[LogEntry],
        refuses=(InvalidValue, FileUnreadable),
        client="logs",
    )
    async def logs(
        ask: Ask,
        since: Annotated[str, Query(max_length=40, description=_DATE)] = "",
        level: Annotated[LogLevel, Query(description="the lowest level")] = "info",
        limit: Annotated[int, Query(ge=1, le=MOST_ENTRIES, description="greatest number of entries")] = 100,
    ) -> Response:
        """Return the newest entries of the log, oldest first; those of events and requests are included."""
        begin = _date(since)
        path = await ask(_log)
        async with ask.bridge.past.turn():
            return answer(await asyncio.to_thread(newest, path, limit, begin, level))

    @routes.add(
        "GET", "/v1/doctor", Operation.DIAGNOSE, tag=_DIAGNOSIS, gives=Diagnosis, client="doctor", patience=AT_REST
    )
    async def doctor(ask: Ask) -> Response:
        """Check the robot, the queue, the configuration and the computer; nothing moves and nothing is changed."""
        of_robot, config, status = await ask(lambda service: _looked_at(service, ask.caller))
        reasons = (await readiness(ask.bridge, ask.language)).reasons
        ready = doctor_robot.readiness((reason.message for reason in reasons), status)
        async with ask.bridge.checking:
            named = ask.bridge.config_file
            of_host = await asyncio.to_thread(_checked, named, config, ask.language)
        found = (*ready, *of_robot, *of_host)
        return answer(Diagnosis(tuple(message(finding, ask.language) for finding in found)))

    @routes.add(
        "POST",
        "/v1/terminal",
        Operation.TERMINAL,
        tag=_DIAGNOSIS,
        gives=TerminalReply,
        refuses=(TerminalReadsOnly, NotConnected, NotOverRos),
        examples={"encoder positions": {"command": "TP"}, "a gain": {"command": "KPA=?"}},
        client="interrogate",
    )
    async def interrogate(ask: Ask, body: CommandBody) -> Response:
        """Send the controller one command that only reads, and return its answer.

        `TP A`, `KP ?`, `MG _TPA` and `speed=?` read; commands that change something are refused (4056).
        """
        command = body.command
        return answer(await ask(lambda service: service.interrogate(command), subject=command))

    @routes.add(
        "GET",
        "/v1/scope",
        Operation.READ,
        tag=_DIAGNOSIS,
        gives=ScopeView,
        refuses=(UnknownName,),
        client="scope",
    )
    async def scope(
        ask: Ask,
        seconds: Annotated[float, Query(gt=0, le=LONGEST_SCOPE, description="duration until now [s]")] = 20.0,
        rate: Annotated[float, Query(gt=0, le=100, description="greatest number of states a second [Hz]")] = 20.0,
        signal: Annotated[list[str], Query(max_length=64, description=_SIGNAL)] = [],  # noqa: B006
    ) -> Response:
        """Return the last seconds of the states in memory as columns, each with its unit, for plots."""
        async with ask.bridge.past.turn():
            return answer(await ask(lambda service: service.recorder.scope(seconds, rate, signal)))


async def _looked_at(service: Service, by: Caller) -> tuple[list[Finding], Config, dict[str, Any]]:
    """Return the results of the checks of the robot, the configuration that applies, and the status as plain data."""
    status, datum = to_data(await service.status()), to_data(service.datum())
    lease, queue = to_data(await service.lease.view(by)), to_data(service.queue.view())
    found = [*doctor_robot.robot(status, datum), *doctor_robot.lease(lease), *doctor_robot.queue(queue)]
    return found, service.config(), status


def _checked(named: Path | None, config: Config, language: str) -> list[Finding]:
    return list(guarded(host.looks(named, config, language, os.getpid()), written_down))


async def _log(_service: Service) -> Path:
    return log_path()


def _date(text: str) -> str:
    """Return a date in the form of all entries, "" for none; raises `InvalidValue`."""
    try:
        return utc(text) if text else ""
    except (ValueError, OverflowError) as error:
        raise InvalidValue(key="since", value=repr(text), reason="it must be a date like 2026-11-21T09:30Z") from error
