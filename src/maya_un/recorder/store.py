"""The recording store: a folder of complete files, limited in number; the oldest are removed first."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from dmc41x3.files import sync_folder, unwritable
from maya_un.config import RecorderConfig
from maya_un.errors import NotFound
from maya_un.recorder.recording import Recording, date
from maya_un.schema.robot import Kept

Clock = Callable[[], int]
"""Returns the date: nanoseconds since 1970, UTC."""

SUFFIX = ".mcap"
DRAFT = ".part"
"""Ending of a file that is being written; `clean` removes one that a killed process left."""

_NAME = re.compile(r"(\d{4}-\d\d-\d\dT\d\d-\d\d-\d\d)Z-([a-z0-9_-]+?)(?:\.(\d+))?\.mcap")
_UNFIT = re.compile(r"[^a-z0-9_]+")


class RecordingStore:
    """Recordings in `folder`, at most `most_files` and `most_bytes` of them; the newest always stays.

    `utc` returns their date.
    """

    def __init__(self, folder: Path, most_files: int, most_bytes: int, utc: Clock) -> None:
        self.folder = folder
        self.utc = utc
        self._most_files = most_files
        self._most_bytes = most_bytes

    @classmethod
    def of(cls, settings: RecorderConfig, folder: Path, utc: Clock) -> RecordingStore:
        """Return the store of a folder, with the configured limits."""
        return cls(folder, settings.files, settings.disk_megabytes * 1_000_000, utc)

    def clean(self) -> None:
        """Remove unfinished files of killed processes."""
        with suppress(OSError):
            for draft in self.folder.glob(f"*{SUFFIX}{DRAFT}"):
                draft.unlink(missing_ok=True)

    def list(self) -> list[Kept]:
        """Return the recordings, newest first."""
        found: list[tuple[int, Kept]] = []
        with suppress(OSError):
            for path in self.folder.iterdir():
                name = _NAME.fullmatch(path.name)
                if name is not None:
                    with suppress(FileNotFoundError):
                        size = path.stat().st_size
                        stamp = name[1][:11] + name[1][11:].replace("-", ":") + "Z"
                        found.append((int(name[3] or 1), Kept(path.name, stamp, name[2], size)))
        return [kept for _, kept in sorted(found, key=lambda one: (one[1].date, one[0], one[1].reason), reverse=True)]

    def path(self, name: str) -> Path:
        """Return the file of a recording; raises `NotFound`, also for invalid names."""
        path = self.folder / name
        if _NAME.fullmatch(name) is None or not path.is_file():
            raise NotFound(what="recording", number=name)
        return path

    def save(self, recording: Recording) -> Kept:
        """Write a recording, whole or not at all, remove old ones, and return its entry; raises `FileUnwritable`.

        It is on the disk when this returns.
        """
        from maya_un.recorder import mcap_file  # noqa: PLC0415 - only a save needs the library

        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            path = self._free(recording)
            draft = path.with_name(path.name + DRAFT)
            draft.unlink(missing_ok=True)  # left by a killed process
            try:
                with draft.open("xb") as file:
                    mcap_file.write(recording, file)
                    file.flush()
                    os.fsync(file.fileno())
                draft.replace(path)
            except BaseException:
                draft.unlink(missing_ok=True)
                raise
            sync_folder(self.folder)
        except OSError as error:
            raise unwritable(self.folder, error) from error
        self._make_room()
        return next(kept for kept in self.list() if kept.name == path.name)

    def _free(self, recording: Recording) -> Path:
        """Return a free name: date, reason, and a number if several recordings have the same second."""
        stamp = date(recording.header.utc)[:19].replace(":", "-")
        reason = _UNFIT.sub("-", recording.header.reason.lower()).strip("-") or "asked"
        path = self.folder / f"{stamp}Z-{reason[:40]}{SUFFIX}"
        number = 1
        while path.exists():
            number += 1
            path = self.folder / f"{stamp}Z-{reason[:40]}.{number}{SUFFIX}"
        return path

    def _make_room(self) -> None:
        kept = self.list()
        size = 0
        for number, one in enumerate(kept):
            size += one.bytes
            if number and (number >= self._most_files or size > self._most_bytes):
                with suppress(OSError):
                    (self.folder / one.name).unlink(missing_ok=True)
