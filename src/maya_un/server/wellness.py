"""Whether the robot can be asked for something: its link, its journal, its queue, its loop."""

from __future__ import annotations

import asyncio

from maya_un.api.service import Service
from maya_un.errors import MayaError, NotConnected, ServiceNotAnswering, StorageFailed
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.robot import Readiness
from maya_un.server.bridge import Bridge
from maya_un.server.metrics import JournalHealth
from maya_un.values import Mode, Notice

PATIENCE = 1.0
"""The robot's loop answers within so long, or it is not ready [s, real time]."""


async def readiness(bridge: Bridge, language: str) -> Readiness:
    """Return how the robot is; answers within `PATIENCE` also where its loop hangs."""
    found = [*bridge.missing()]
    try:
        async with asyncio.timeout(PATIENCE):
            found += await bridge.asked(_obstacles)
    except TimeoutError:
        found += [ServiceNotAnswering(reason=f"the robot's loop is busy for more than {PATIENCE:g} s")]
    failing = await _failing(bridge)
    if failing:
        found.append(StorageFailed(reason=failing))
    reasons = tuple(Notice(error.code, error.text(language)) for error in found)
    return Readiness(not reasons, reasons)


async def _failing(bridge: Bridge) -> str:
    """Return why the journal cannot be written, "" if it can; checked also when no request writes."""
    if not isinstance(bridge.journal, SqliteJournal):
        return ""
    try:
        async with asyncio.timeout(PATIENCE):
            return await bridge.asked(lambda service: service.check_storage())
    except TimeoutError:
        return bridge.journal.failing or f"the disk does not answer within {PATIENCE:g} s"


def storage_of(bridge: Bridge) -> JournalHealth:
    """Return how the journal is; one in memory never fails."""
    journal = bridge.journal
    return JournalHealth(journal.failing, journal.commits) if isinstance(journal, SqliteJournal) else JournalHealth()


async def _obstacles(service: Service) -> list[MayaError]:
    mode = (await service.status()).state.mode
    return [NotConnected()] if mode is Mode.DISCONNECTED else []
