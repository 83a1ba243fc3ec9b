"""The recorder: it always runs beside the robot, holds the last minutes, and saves them after a fault."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import replace
from typing import Protocol

from dmc41x3.wire.transcript import WirePiece
from dmc41x3.wire.transport import Transport
from maya_un.config import RecorderConfig
from maya_un.errors import InternalError, MayaError
from maya_un.events import DECLARED, Connected, Event, EventLog, RecordingSaved, Trouble
from maya_un.recorder.capture import Entry, RecordedTransport, RecorderRing, RingContents
from maya_un.recorder.recording import Header, Recording, RecordingOrigin, SavingCause, Software
from maya_un.recorder.store import RecordingStore
from maya_un.schema.robot import Kept
from maya_un.values import State

LONGEST = 6.0
"""Consecutive faults belong to one recording; it is saved at the latest after this number of times `after`."""

MOST_OPENING = 1 << 20
"""Most bytes stored of the first opening of the link, in which the controller is configured; a longer one is dropped.
"""

TURN = 0.0005
"""While a recording is written the loop waits no longer than this for its turn [s], a tenth of Python's usual time."""

ASKED, CRASH = "asked", "crash"
REASONS = (ASKED, *(word for word, event in DECLARED.items() if issubclass(event, Trouble)), CRASH)
"""The reasons for which a recording is saved: a request, the event that ended motion, or a defect."""

NOBODY = SavingCause()
"""The cause of a recording that a user requested."""

_MEGABYTE = 1 << 20


class RecordedController(Protocol):
    """The recorded object: a controller layer."""

    @property
    def events(self) -> EventLog:
        """Facts in order."""
        ...

    @property
    def firmware(self) -> str:
        """The controller's firmware line."""
        ...

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one."""
        ...


class Recorder:
    """Holds the last minutes of the robot of `origin` in memory, and saves them to `store`.

    Connections to the controller pass through `recorded`, states and events come while `watching`. Without a store
    nothing is saved and no date is needed; `taken` returns the recorded data.
    """

    def __init__(self, settings: RecorderConfig, origin: RecordingOrigin, store: RecordingStore | None = None) -> None:
        self._loop = asyncio.get_running_loop()
        self._after = settings.after
        self._ring = RecorderRing(settings.seconds, settings.megabytes * _MEGABYTE)
        self._origin = origin
        self._software = Software.running()
        self.store = store
        self._source: RecordedController | None = None
        self._links = 0
        self._opening: tuple[WirePiece, ...] = ()
        self._opened_at: float | None = None
        self._incident: Event | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._savers: set[asyncio.Task[None]] = set()
        self._saving = asyncio.Lock()
        if store is not None:
            store.clean()

    @property
    def ring(self) -> RecorderRing:
        """The data in memory."""
        return self._ring

    @property
    def speed(self) -> float:
        """The speed of the loop's clock."""
        return self._origin.speed

    def recorded(self, transport: Transport) -> Transport:
        """Wrap a new connection to the controller, so that its traffic is recorded."""
        self._links += 1
        return RecordedTransport(transport, self._ring.piece, self._links)

    @asynccontextmanager
    async def watching(self, source: RecordedController) -> AsyncIterator[None]:
        """Record the states and events of `source` while the block runs, and save them after every fault.

        If a fault still waits to be saved when the block ends, it is saved at once. A defect that ends the block also
        saves the data.
        """
        self._source = source
        watcher = self._loop.create_task(self._watch(source), name="flight recorder")
        try:
            with source.events.listening(self._event):
                yield
        except Exception as error:
            if not isinstance(error, MayaError):
                self._last_words(CRASH, SavingCause(kind=type(error).__name__, message=str(error)))
            raise
        finally:
            watcher.cancel()
            await asyncio.gather(watcher, return_exceptions=True)
            await self._end_incident()

    def taken(self, reason: str, cause: SavingCause = NOBODY) -> Recording:
        """Return the present data as a recording."""
        return self._composed(self._header(reason, cause), self._ring.contents())

    async def save(self, reason: str = ASKED, cause: SavingCause = NOBODY) -> Kept | None:
        """Save the present data without blocking the loop, and emit the event; return None without a store.

        Raises `FileUnwritable`, and `InternalError` for a defect; the event reports both too.
        """
        if self.store is None:
            return None
        header, entries = self._header(reason, cause), self._ring.entries()
        try:
            async with self._saving:
                work = self._loop.run_in_executor(None, self._write, self.store, header, entries)
                kept = await asyncio.shield(work)
        except MayaError as error:
            self._tell(RecordingSaved(reason, str(error), code=error.code))
            raise
        except Exception as defect:
            error = InternalError(reason=repr(defect))
            self._tell(RecordingSaved(reason, str(error), code=error.code))
            raise error from defect
        self._tell(RecordingSaved(reason, name=kept.name, bytes=kept.bytes))
        return kept

    def _write(self, store: RecordingStore, header: Header, entries: list[Entry]) -> Kept:
        with _giving_way():
            return store.save(self._composed(header, self._ring.contents(entries)))

    def _tell(self, event: RecordingSaved) -> None:
        if self._source is not None:
            self._source.events.emit(event)

    async def _watch(self, source: RecordedController) -> None:
        async for state in source.watch():
            self._ring.state(state)

    def _event(self, event: Event) -> None:
        self._ring.event(event)
        if isinstance(event, Connected) and self._opened_at is None:
            self._keep_opening(event.time)
        if isinstance(event, Trouble) and event.code:
            self._begin_incident(event)

    def _keep_opening(self, time: float) -> None:
        """Store the wire of the controller's configuration; later recordings need it, however old it is."""
        self._opened_at = time
        wire = self._ring.contents().wire
        if sum(len(piece.data) for piece in wire) <= MOST_OPENING:
            self._opening = wire

    def _begin_incident(self, event: Event) -> None:
        """Save after a while; faults that come meanwhile belong to the same incident, and delay the save."""
        due = self._loop.time() + self._after
        if self._timer is not None and self._incident is not None:
            self._timer.cancel()
            due = min(due, self._incident.time + LONGEST * self._after)
        else:
            self._incident = event
        self._timer = self._loop.call_at(due, self._incident_over)

    def _incident_over(self) -> None:
        event, self._incident, self._timer = self._incident, None, None
        if event is not None:
            saver = self._loop.create_task(self._save_incident(event), name="save the recording")
            self._savers.add(saver)
            saver.add_done_callback(self._savers.discard)

    async def _save_incident(self, event: Event) -> None:
        with suppress(MayaError):  # an event has reported the failed write
            await self.save(event.kind, _cause(event))

    async def _end_incident(self) -> None:
        """Save the pending recordings."""
        if self._timer is not None and self._incident is not None:
            self._timer.cancel()
            self._last_words(self._incident.kind, _cause(self._incident))
            self._incident = self._timer = None
        await asyncio.gather(*self._savers)

    def _last_words(self, reason: str, cause: SavingCause) -> None:
        """Save at once, in this thread, as far as possible: the loop may be at its end."""
        if self.store is None:
            return
        try:
            kept = self.store.save(self.taken(reason, cause))
        except Exception as error:  # noqa: BLE001 - another error comes first, and must be reported
            code = error.code if isinstance(error, MayaError) else InternalError.code
            self._tell(RecordingSaved(reason, str(error), code=code))
        else:
            self._tell(RecordingSaved(reason, name=kept.name, bytes=kept.bytes))

    def _header(self, reason: str, cause: SavingCause) -> Header:
        return Header(
            reason=reason,
            saved=self._loop.time(),
            utc=0 if self.store is None else self.store.utc(),
            whole=0.0,
            complete=False,
            firmware="" if self._source is None else self._source.firmware,
            origin=self._origin,
            software=self._software,
            cause=cause,
            opening=0.0 if self._opened_at is None else self._opened_at,
        )

    def _composed(self, header: Header, contents: RingContents) -> Recording:
        wire = contents.wire
        if contents.dropped:
            wire = (*(piece for piece in self._opening if piece.time < contents.whole), *wire)
        header = replace(header, whole=contents.whole, complete=not contents.dropped)
        return Recording(header, contents.states, contents.events, wire)


@contextmanager
def _giving_way() -> Iterator[None]:
    """Switch threads more often than usual, so that the loop gets its turn while another thread works."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(min(before, TURN))
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def _cause(event: Event) -> SavingCause:
    return SavingCause(event.seq, event.kind, event.code, str(event.detail.get("message", "")))
