"""`maya record`: list, save, show and export recordings."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

from dmc41x3 import files
from dmc41x3.i18n import marked, translate
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.report import table
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.config import RecorderConfig
from maya_un.config.state_folder import state_folder
from maya_un.errors import InvalidCommandLine, NotFound
from maya_un.recorder.store import RecordingStore

_SAVING = 60.0
"""Longest wait for a recording to be written [s]."""


def folder() -> Path:
    """Return the folder of recordings."""
    return state_folder() / "recordings"


def found(name: str) -> Path:
    """Return the file of a recording; `name` is a path, or the name of a recording in the folder. Raises `NotFound`."""
    path = Path(name)
    if path.exists():
        return path
    if path.name == name:
        return store(RecorderConfig()).path(name)
    raise NotFound(what="recording", number=name)


def store(settings: RecorderConfig) -> RecordingStore:
    """Return the store of recordings on this computer, with the limits of the configuration."""
    return RecordingStore.of(settings, folder(), time.time_ns)


def listed(settings: OutputSettings) -> int:
    """Print the recordings in the folder, newest first; no robot is needed."""
    kept = store(RecorderConfig()).list()
    head = tuple(translate(text, settings.language) for text in (marked("name"), marked("reason"), marked("size")))
    rows = [(one.name, one.reason, f"{one.bytes / 1e6:.2f} MB") for one in kept]
    text = (
        table(head, rows, right=(2,))
        if rows
        else translate("There are no recordings in {folder}.", settings.language, folder=folder())
    )
    lines = [{"name": one.name, "date": one.date, "reason": one.reason, "bytes": one.bytes} for one in kept]
    return output.answer({"folder": str(folder()), "recordings": lines}, text, settings)


def save(settings: OutputSettings) -> int:
    """Let the running robot save its last minutes now; raises `ServiceNotRunning`."""
    kept = ServiceClient.find().ask(requests.save_recording(), timeout=_SAVING)
    return output.answer(kept, translate("Saved: {name}", settings.language, name=kept["name"]), settings)


def show(name: str, settings: OutputSettings) -> int:
    """Print a summary of a recording: reason, date, origin and contents; raises `FileUnreadable`."""
    from maya_un.recorder import mcap_file

    path = found(name)
    recording = mcap_file.read(path)
    header = recording.header
    begin, end = recording.span
    kinds = Counter(event.kind for event in recording.events)
    data = {
        "file": str(path),
        "reason": header.reason,
        "date": header.date,
        "cause": {"seq": header.cause.seq, "kind": header.cause.kind, "code": header.cause.code}
        | {"message": header.cause.message},
        "begin": begin,
        "end": end,
        "complete": header.complete,
        "address": header.origin.address,
        "firmware": header.firmware,
        "twin": header.origin.twin is not None,
        "version": header.software.maya_un,
        "states": len(recording.states),
        "events": dict(kinds),
        "wire": {"pieces": len(recording.wire), "bytes": sum(len(piece.data) for piece in recording.wire)},
    }
    lines = [
        translate(
            "{reason}, saved {date}, the last {seconds:.1f} s",
            settings.language,
            reason=header.reason,
            date=header.date,
            seconds=end - begin,
        ),
        header.cause.message,
        translate("controller {address}", settings.language, address=header.origin.address) + f" · {header.firmware}",
        translate(
            "{states} states, {wire} packets of controller traffic",
            settings.language,
            states=len(recording.states),
            wire=len(recording.wire),
        ),
        ", ".join(f"{kind} {count}" for kind, count in sorted(kinds.items())),
    ]
    return output.answer(data, "\n".join(line for line in lines if line), settings)


def export(name: str, mcap: str | None, csv: str | None, wire: str | None, settings: OutputSettings) -> int:
    """Write a recording as MCAP, and its states and its controller traffic as CSV, to the given files.

    Raises `InvalidCommandLine` without a file, `FileUnreadable` and `FileUnwritable`.
    """
    if mcap is None and csv is None and wire is None:
        raise InvalidCommandLine(reason="--mcap, --csv or --wire is missing", command="maya record export")
    from maya_un.recorder import mcap_file, tables
    from maya_un.recorder.rows import state_rows

    path = found(name)
    header = mcap_file.read_header(path)
    written: list[str] = []
    if mcap is not None:
        written.append(_copy(path, Path(mcap)))
    if csv is not None:
        written.append(_table(Path(csv), lambda file: tables.write_states(header, state_rows(path), file)))
    if wire is not None:
        written.append(_table(Path(wire), lambda file: tables.write_wire(mcap_file.read(path), file)))
    text = "\n".join(translate("Written: {path}", settings.language, path=place) for place in written)
    return output.answer({"written": written}, text, settings)


def _copy(source: Path, target: Path) -> str:
    files.write(target, files.read_bytes(source))
    return str(target)


def _table(path: Path, write: Callable[[TextIO], None]) -> str:
    with files.replacing(path, newline="") as file:
        write(file)
    return str(path)
