"""Routes by which users find out what is wrong: the log."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

from fastapi import Query, Response

from maya_un.errors import FileUnreadable, InvalidValue
from maya_un.http.exchange import answer
from maya_un.http.log import log_path
from maya_un.http.log_reader import MOST_ENTRIES, newest, utc
from maya_un.http.request_context import Ask
from maya_un.http.routing import Routes
from maya_un.schema.diagnosis import LogEntry, LogLevel
from maya_un.service.access.operations import Operation
from maya_un.service.service import Service

_DIAGNOSIS = "diagnosis"
_DATE = "only entries from this date on (ISO 8601); without a zone it is in the local time of the service"


def add_diagnosis(routes: Routes) -> None:
    """Add the route for the log."""

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


async def _log(_service: Service) -> Path:
    return log_path()


def _date(text: str) -> str:
    """Return a date in the form of all entries, "" for none; raises `InvalidValue`."""
    try:
        return utc(text) if text else ""
    except (ValueError, OverflowError) as error:
        raise InvalidValue(key="since", value=repr(text), reason="it must be a date like 2026-11-21T09:30Z") from error
