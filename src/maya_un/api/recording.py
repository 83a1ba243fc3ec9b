"""Recordings for the service: list them, save one now, find the file of one."""

from __future__ import annotations

from pathlib import Path

from maya_un.api.access.caller import LOCAL, Caller
from maya_un.errors import InvalidRequest, NotFound
from maya_un.recorder.header import SavingCause
from maya_un.recorder.recorder import Recorder
from maya_un.schema.robot import Kept


class RecordingService:
    """Asks the flight recorder; without one, or with one that keeps no files, there are no recordings."""

    def __init__(self, recorder: Recorder | None = None) -> None:
        self._recorder = recorder

    def list(self) -> list[Kept]:
        """Return the recordings that are kept, newest first; a line each: name, date, reason, size in bytes."""
        shelf = None if self._recorder is None else self._recorder.shelf
        return [] if shelf is None else shelf.list()

    async def save(self, by: Caller = LOCAL) -> Kept:
        """Save the last minutes now and return the line of the recording.

        Raises `FileUnwritable`, and `InvalidRequest` where no recorder runs (`recorder.enabled`, dry runs).
        """
        cause = SavingCause(message=f"asked by {by.name}")
        kept = None if self._recorder is None else await self._recorder.save("asked", cause)
        if kept is None:
            raise InvalidRequest(key="recorder", reason="nothing is recorded here")
        return kept

    def path(self, name: str) -> Path:
        """Return the file of a recording (MCAP); raises `NotFound`."""
        shelf = None if self._recorder is None else self._recorder.shelf
        if shelf is None:
            raise NotFound(what="recording", number=name)
        return shelf.path(name)
