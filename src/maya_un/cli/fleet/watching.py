"""`maya fleet list --follow` beside a robot: the fleet for the displays of its service.

It is a separate process: a message costs 0.2 ms of the interpreter, and the robot's program has one for all its threads
(decision 58). It reads the same environment variables as `maya coms`.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from random import Random
from urllib.parse import urlsplit

from pydantic import TypeAdapter

from dmc41x3.i18n import phrase
from maya_un.coms.settings import where_of
from maya_un.coms.transport import keep
from maya_un.errors import MayaError, SupervisorsNotReached
from maya_un.http import dates
from maya_un.schema.fleet import FleetView
from maya_un.service.fleet import FleetService
from maya_un.values import Notice

_COMMAND = (sys.executable, "-m", "maya_un.cli.parent_watch", "fleet", "list", "--follow", "--json")

_LONGEST = 4_000_000
"""Greatest length of a list [bytes]; that of the largest fleet is shorter."""

_PATIENCE = 5.0
"""Longest wait for the end of the process [s]."""


@asynccontextmanager
async def fleet_beside(fleet: FleetService) -> AsyncIterator[None]:
    """Show in `fleet` the robots of the MQTT broker in MAYA_COMS_URL while the block runs.

    The process starts again if it ends, after a pause.
    """
    url = os.environ.get("MAYA_COMS_URL", "")
    where = where_of(url)
    if urlsplit(where).scheme not in {"mqtt", "mqtts"}:
        fleet.show(FleetView("unsupported" if url else "none", where))
        yield
        return
    fleet.show(FleetView("connecting", where))

    def failed(error: MayaError) -> None:
        found = fleet.view()
        fleet.show(FleetView("lost", where, dates.moment(), Notice(error.code, str(error)), robots=found.robots))

    watching = asyncio.create_task(keep(lambda: _watch(fleet, where), failed, Random()), name="fleet")
    try:
        yield
    finally:
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)


async def _watch(fleet: FleetService, where: str) -> None:
    """Run the process and show its lists until it ends; raises `SupervisorsNotReached` with its reason."""
    try:
        process = await asyncio.create_subprocess_exec(*_COMMAND, stdin=PIPE, stdout=PIPE, limit=_LONGEST)
    except OSError as error:
        raise SupervisorsNotReached(where=where, reason=error.strerror or str(error)) from error
    said = b""
    try:
        assert process.stdout is not None
        async for line in process.stdout:
            said = line
            with suppress(ValueError):
                fleet.show(_VIEW.validate_json(line))
    except ValueError as error:  # a line longer than the limit
        reason = phrase("its list of robots has more than {most} bytes", most=_LONGEST)
        raise SupervisorsNotReached(where=where, reason=reason) from error
    finally:
        await _end(process)
    raise SupervisorsNotReached(where=where, reason=_reason(said))


async def _end(process: Process) -> None:
    """End the process: it ends with its input, or is killed."""
    assert process.stdin is not None
    process.stdin.close()
    try:
        async with asyncio.timeout(_PATIENCE):
            await process.communicate()  # unread output would keep the pipe open
    except TimeoutError:
        process.kill()
        await process.wait()


def _reason(said: bytes) -> str:
    """Return the error that ended the process."""
    try:
        return str(json.loads(said)["error"]["message"])
    except (ValueError, KeyError, TypeError):
        return "`maya fleet list --follow` ended"


_VIEW = TypeAdapter(FleetView)
