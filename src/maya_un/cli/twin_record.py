"""The file to which `maya dmc serve --record` adds the record of the mechanics."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from dmc41x3.files import open_own
from maya_un.assembly import Twin
from maya_un.errors import FileUnwritable
from maya_un.machine.chronicle import MechanicsRecordWriter
from maya_un.server.dates import epoch


class LineFile:
    """A regular file that lines are added to; each is with the system before `add` returns."""

    def __init__(self, path: str, descriptor: int) -> None:
        self._path = path
        self._descriptor = descriptor
        self._failure: OSError | None = None

    @classmethod
    @contextmanager
    def opened(cls, path: str) -> Iterator[LineFile]:
        """Open a file for the length of the block; raises `FileUnwritable` also for what is no regular file."""
        descriptor = open_own(Path(path), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        try:
            yield cls(path, descriptor)
        finally:
            os.close(descriptor)

    def add(self, line: str) -> None:
        """Add a line; write nothing after a failure, so that no line is missing in between."""
        data = line.encode("utf-8")
        try:
            while data and self._failure is None:
                data = data[os.write(self._descriptor, data) :]
        except OSError as error:
            self._failure = error

    def check(self) -> None:
        """Raise `FileUnwritable` where a line could not be written."""
        if self._failure is not None:
            _refuse(self._path, self._failure.strerror or str(self._failure))


def _refuse(path: str, reason: str) -> NoReturn:
    raise FileUnwritable(path=path, reason=reason)


class TwinRecord:
    """The record of the mechanics of `twin`, written to `file` from now on."""

    def __init__(self, twin: Twin, file: LineFile) -> None:
        self._controller = twin.controller
        self._file = file
        born = epoch() - twin.controller.machine.now
        self._chronicle = MechanicsRecordWriter(twin.mechanics, file.add, born)

    async def keep(self, period: float) -> None:
        """Write motion every `period` [s] until cancelled, and once more then.

        Raises `FileUnwritable` once a line cannot be written.
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
