"""The progress of a process, on the disk: one line of JSON for each event, appended before it counts.

    {"process": "hand over", "digest": "9f…"}
    {"step": "fetch", "sent": "5b0c…", "text": "{…}"}       written before the command is sent
    {"step": "fetch", "result": {"id": "5b0c…", "success": true, …}}
    {"step": "give", "decision": "retry"}                   or skip; {"decision": "abort"}

A line that a crash left unfinished is dropped.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from dmc41x3.files import open_own, sync_folder, unwritable
from maya_un.errors import FileUnreadable, ProcessAborted, ProcessChanged, StorageInUse
from maya_un.graph.step_text import StepEnd
from maya_un.supervisor.process import FleetProcess
from maya_un.supervisor.step import result_of


class FailureDecision(StrEnum):
    """The decision of a person about a failed step."""

    RETRY = "retry"
    SKIP = "skip"
    ABORT = "abort"


class ProcessStepState(StrEnum):
    """How far a step of a process has come."""

    WAITING = "waiting"
    SENT = "sent"
    DONE = "done"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(slots=True)
class StepEntry:
    """The present data of a step: the id and text of its latest command, and its result."""

    state: ProcessStepState = ProcessStepState.WAITING
    id: str | None = None
    text: str | None = None
    result: StepEnd | None = None


class ProcessRecord:
    """The record of a process in an open file; every change is on the disk when its method returns."""

    def __init__(self, descriptor: int, path: Path, process: FleetProcess) -> None:
        self._descriptor = descriptor
        self._path = path
        self.process = process
        self.entries = {id_: StepEntry() for id_ in process.steps}
        self.aborted = False

    def sent(self, step: str, id_: str, text: str) -> None:
        """Note a command that is sent next."""
        self._append({"step": step, "sent": id_, "text": text})

    def ended(self, step: str, result: StepEnd) -> None:
        """Note a result."""
        self._append({"step": step, "result": json.loads(result.text)})

    def decided(self, step: str, decision: FailureDecision) -> None:
        """Note what a person decided about a failed step."""
        self._append({"step": step, "decision": decision.value})

    def abort(self) -> None:
        """Note that a person ends the process."""
        self._append({"decision": FailureDecision.ABORT.value})

    def require_not_aborted(self) -> None:
        """Raise `ProcessAborted` if a person ended the process."""
        if self.aborted:
            done = sum(entry.state is ProcessStepState.DONE for entry in self.entries.values())
            raise ProcessAborted(done=done, steps=len(self.entries))

    def failed(self) -> list[str]:
        """Return the failed steps, in the order of the file."""
        return [id_ for id_, entry in self.entries.items() if entry.state is ProcessStepState.FAILED]

    @property
    def finished(self) -> bool:
        """Whether all steps are done or skipped."""
        return all(entry.state in {ProcessStepState.DONE, ProcessStepState.SKIPPED} for entry in self.entries.values())

    def _append(self, line: dict[str, Any]) -> None:
        try:
            os.write(self._descriptor, json.dumps(line).encode() + b"\n")
            os.fsync(self._descriptor)
        except OSError as error:
            raise unwritable(self._path, error) from error
        self.apply(line)

    def apply(self, line: dict[str, Any]) -> None:
        """Take in what a line says."""
        if line.get("decision") == FailureDecision.ABORT:
            self.aborted = True
            return
        entry = self.entries[line["step"]]
        if "sent" in line:
            entry.state, entry.id, entry.text, entry.result = ProcessStepState.SENT, line["sent"], line["text"], None
        elif "result" in line:
            entry.result = result_of(line["result"])
            success = entry.result is not None and entry.result.error is None
            entry.state = ProcessStepState.DONE if success else ProcessStepState.FAILED
        else:
            entry.state = (
                ProcessStepState.WAITING if line["decision"] == FailureDecision.RETRY else ProcessStepState.SKIPPED
            )


@contextmanager
def recorded(path: Path, process: FleetProcess, *, again: bool = False) -> Iterator[ProcessRecord]:
    """Open the record of a process, or begin one; with `again` the old one is dropped.

    Raises `ProcessChanged` for the record of another process, `StorageInUse` while another program uses it,
    `FileUnreadable` for a file that is no record, `FileUnwritable`.
    """
    descriptor = open_own(path, os.O_RDWR | os.O_CREAT | os.O_APPEND)
    try:
        _lock(descriptor, path)
        if again:
            os.ftruncate(descriptor, 0)
        record = ProcessRecord(descriptor, path, process)
        lines = _lines(descriptor, path)
        head = {"process": process.name, "digest": process.digest}
        if not lines:
            os.write(descriptor, json.dumps(head).encode() + b"\n")
            os.fsync(descriptor)
            sync_folder(path.parent)
        elif lines[0].get("digest") != process.digest:
            raise ProcessChanged(path=path)
        _replay(record, lines[1:], path)
        yield record
    except OSError as error:
        raise unwritable(path, error) from error
    finally:
        os.close(descriptor)


def _lock(descriptor: int, path: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise StorageInUse(path=path, pid="?") from error


def _lines(descriptor: int, path: Path) -> list[dict[str, Any]]:
    """Return what the lines say; cut off one that is not whole."""
    with os.fdopen(os.dup(descriptor), "rb") as file:
        file.seek(0)
        data = file.read()
    whole = data[: data.rfind(b"\n") + 1]
    if len(whole) != len(data):
        os.ftruncate(descriptor, len(whole))
    try:
        lines = [json.loads(line) for line in whole.splitlines()]
    except ValueError as error:
        raise FileUnreadable(path=path, reason="it is not the state of a process") from error
    if not all(isinstance(line, dict) for line in lines):
        raise FileUnreadable(path=path, reason="it is not the state of a process")
    return lines


def _replay(record: ProcessRecord, lines: list[dict[str, Any]], path: Path) -> None:
    try:
        for line in lines:
            record.apply(line)
    except (KeyError, TypeError) as error:
        raise FileUnreadable(path=path, reason="it is not the state of a process") from error
