"""A process over several robots: its file of steps, the record of its progress, and its runner.

The file:

    name: hand over
    deadline: 60            # a step starts within so many seconds after it was sent; optional
    steps:
    - {id: fetch, robot: MAYA, command: pick, args: {x: 0.5, y: 1.1, z: 0.4}}
    - {id: give, robot: MAYA, command: place, args: {x: 0.3, y: 1.2, z: 0.4}, after: [fetch]}
    - {id: take, robot: MAYA2, command: pick, args: {x: 0.4, y: 1.0, z: 0.4}, after: [give]}

The record on disk has one line of JSON for each event, appended before the event counts:

    {"process": "hand over", "digest": "9f…"}
    {"step": "fetch", "sent": "5b0c…", "text": "{…}"}       written before the command is sent
    {"step": "fetch", "result": {"id": "5b0c…", "success": true, …}}
    {"step": "give", "decision": "retry"}                   or skip; {"decision": "abort"}

A line that a crash left unfinished is dropped. A file with another first line is not a record and stays unchanged.

The runner sends a step when the steps before it are done and its robot has no other step of the process. A failed step
blocks only the steps after it. When no other step can run, `run` ends and a person decides; then another run continues.
Every event is recorded first, so an interrupted process continues. A command is sent again under its id, and the robot
carries it out once.
"""

from __future__ import annotations

import asyncio
import fcntl
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from graphlib import CycleError, TopologicalSorter
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import uuid4

from dmc41x3.files import open_own, sync_folder, unwritable
from dmc41x3.i18n import phrase
from maya_un.coms.mqtt import topic
from maya_un.errors import (
    DecisionNeeded,
    FileUnreadable,
    InvalidProcess,
    MayaError,
    ProcessAborted,
    ProcessChanged,
    StorageInUse,
)
from maya_un.process.spec.documents import read_document
from maya_un.steps.text import StepEnd, StepProgress
from maya_un.supervisor.lab import DEADLINE, Supervisor
from maya_un.supervisor.step import LONGEST_DEADLINE, Step, check, command_text, result_of, shown

_LONGEST_TEXT = 64
"""Maximum length of a name or id [characters]."""


@dataclass(frozen=True, slots=True)
class ProcessStep:
    """A step of a process; it starts when the steps in `after` have ended."""

    id: str
    robot: str
    command: str
    args: dict[str, Any]
    after: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FleetProcess:
    """Steps by id, in the order of the file. `deadline` is the time from sending a step to its start [s]."""

    name: str
    steps: dict[str, ProcessStep]
    deadline: float = DEADLINE

    @property
    def digest(self) -> str:
        """Hash of the steps of a process; it identifies the process in its record."""
        return sha256(json.dumps([asdict(step) for step in self.steps.values()]).encode()).hexdigest()

    def sorter(self) -> TopologicalSorter[str]:
        """Return the graph of the steps."""
        return TopologicalSorter({step.id: step.after for step in self.steps.values()})


def load_process(path: Path) -> FleetProcess:
    """Return the process in a YAML or JSON file; its default name is that of the file.

    Raises `FileUnreadable` for a file that cannot be read or parsed, `InvalidProcess` for content that cannot be
    carried out completely.
    """
    data = _mapping(read_document(path), phrase("the file"), {"steps"}, {"name", "deadline"})
    if not isinstance(data["steps"], list) or not data["steps"]:
        raise InvalidProcess(key="steps", reason="it must be a list of steps")
    steps: dict[str, ProcessStep] = {}
    for number, one in enumerate(data["steps"], 1):
        step = _planned(one, phrase("steps, number {number}", number=number))
        if step.id in steps:
            raise InvalidProcess(key=step.id, reason="two steps have this id")
        steps[step.id] = step
    process = FleetProcess(_text(data.get("name", path.stem), "name"), steps, _deadline(data.get("deadline", DEADLINE)))
    _check_graph(process)
    return process


def _planned(data: object, key: str) -> ProcessStep:
    found = _mapping(data, key, {"id", "robot", "command"}, {"args", "after"})
    id_ = _text(found["id"], f"{key}, id")
    command = _text(found["command"], f"{id_}, command")
    robot = _text(found["robot"], f"{id_}, robot")
    args = found.get("args") or {}
    if not isinstance(args, dict):
        raise InvalidProcess(key=f"{id_}, args", reason=phrase("it must be an object like {{x: 0.5, y: 1.1, z: 0.4}}"))
    try:
        topic(robot, "commands")
        check(command, args)
    except MayaError as error:
        raise InvalidProcess(key=id_, reason=str(error).rstrip(".")) from error
    after = found.get("after") or []
    if not isinstance(after, list):
        raise InvalidProcess(key=f"{id_}, after", reason="it must be a list of ids")
    return ProcessStep(id_, robot, command, args, tuple(_text(one, f"{id_}, after") for one in after))


def _check_graph(process: FleetProcess) -> None:
    for step in process.steps.values():
        unknown = [name for name in step.after if name not in process.steps]
        if unknown:
            raise InvalidProcess(key=f"{step.id}, after", reason=phrase("there is no step {step}", step=unknown[0]))
    try:
        process.sorter().prepare()
    except CycleError as error:
        raise InvalidProcess(
            key="after", reason=phrase("these steps wait for each other: {steps}", steps=_chain(error.args[1]))
        ) from error


def _chain(ids: Iterable[str]) -> str:
    return " -> ".join(ids)


def _mapping(data: object, key: str, needed: set[str], optional: set[str]) -> Mapping[str, Any]:
    if not isinstance(data, dict):
        raise InvalidProcess(
            key=key, reason=phrase("it must be an object with {names}", names=", ".join(sorted(needed)))
        )
    for name in sorted(needed - set(data)):
        raise InvalidProcess(key=key, reason=phrase("{name} is missing", name=name))
    for name in data:
        if name not in needed | optional:
            raise InvalidProcess(
                key=key,
                reason=phrase(
                    "{name!r} is not known; there are {names}",
                    name=shown(name),
                    names=", ".join(sorted(needed | optional)),
                ),
            )
    return data


def _text(value: object, key: str) -> str:
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) < 10**_LONGEST_TEXT:
        value = str(value)  # YAML reads an id like 7 as a number
    if not isinstance(value, str) or not value or len(value) > _LONGEST_TEXT or not value.isprintable():
        raise InvalidProcess(key=key, reason="it must be text of 1 to 64 printable characters")
    return value


def _deadline(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value <= LONGEST_DEADLINE:
        raise InvalidProcess(
            key="deadline", reason=phrase("it must be seconds, more than 0, at most {most:g}", most=LONGEST_DEADLINE)
        )
    return float(value)


class FailureDecision(StrEnum):
    """The decision of a person about a failed step."""

    RETRY = "retry"
    SKIP = "skip"
    ABORT = "abort"


class ProcessStepState(StrEnum):
    """The state of a step of a process."""

    WAITING = "waiting"
    SENT = "sent"
    DONE = "done"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(slots=True)
class StepEntry:
    """The current data of a step: the id and text of its latest command, and its result."""

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
        """Record a command before it is sent."""
        self._append({"step": step, "sent": id_, "text": text})

    def ended(self, step: str, result: StepEnd) -> None:
        """Record a result."""
        self._append({"step": step, "result": json.loads(result.text)})

    def decided(self, step: str, decision: FailureDecision) -> None:
        """Record the decision of a person about a failed step."""
        self._append({"step": step, "decision": decision.value})

    def abort(self) -> None:
        """Record that a person ends the process."""
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
            _write_line(self._descriptor, line)
        except OSError as error:
            raise unwritable(self._path, error) from error
        self.apply(line)

    def apply(self, line: dict[str, Any]) -> None:
        """Apply a line of the record."""
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
    """Open or create the record of a process; with `again`, delete the old one.

    Raises `ProcessChanged` for the record of another process, `StorageInUse` while another program uses it,
    `FileUnreadable` for a file that is not a record, `FileUnwritable`.
    """
    descriptor = open_own(path, os.O_RDWR | os.O_CREAT | os.O_APPEND)
    try:
        try:
            record = _opened(descriptor, path, process, again=again)
        except OSError as error:
            raise unwritable(path, error) from error
        yield record
    finally:
        os.close(descriptor)


def _opened(descriptor: int, path: Path, process: FleetProcess, *, again: bool) -> ProcessRecord:
    """Return the record in an open file; a file that is not a record stays unchanged. Raises as `recorded` does."""
    _lock(descriptor, path)
    record = ProcessRecord(descriptor, path, process)
    data, head = _content(descriptor), {"process": process.name, "digest": process.digest}
    is_new = json.dumps(head).encode().startswith(data)  # it is empty, or a crash left the first line unfinished
    if not is_new:
        _require_head(data, path)
    if is_new or again:
        os.ftruncate(descriptor, 0)
        _write_line(descriptor, head)
        sync_folder(path.parent)
        return record
    whole = data[: data.rfind(b"\n") + 1]
    first, *lines = (_parsed(line, path) for line in whole.splitlines())
    if first["digest"] != process.digest:
        raise ProcessChanged(path=path)
    _replay(record, lines, path)
    if len(whole) != len(data):
        os.ftruncate(descriptor, len(whole))
    return record


def _write_line(descriptor: int, line: Mapping[str, Any]) -> None:
    """Append a line and flush it to the disk; if that fails, remove the line again and raise `OSError`."""
    data, length = json.dumps(line).encode() + b"\n", os.fstat(descriptor).st_size
    try:
        while data:  # a nearly full disk takes only a part
            data = data[os.write(descriptor, data) :]
        os.fsync(descriptor)
    except OSError:
        os.ftruncate(descriptor, length)
        raise


def _lock(descriptor: int, path: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise StorageInUse(path=path, pid="?") from error


def _content(descriptor: int) -> bytes:
    with os.fdopen(os.dup(descriptor), "rb") as file:
        file.seek(0)
        return file.read()


def _require_head(data: bytes, path: Path) -> None:
    """Raise `FileUnreadable` if the first line of a file is not that of a record."""
    line, end, _ = data.partition(b"\n")
    if not end or not {"process", "digest"} <= _parsed(line, path).keys():
        raise FileUnreadable(path=path, reason="it is not the state of a process")


def _parsed(line: bytes, path: Path) -> dict[str, Any]:
    """Return a line as data; raises `FileUnreadable` if it is not a JSON object."""
    with suppress(ValueError, RecursionError):
        found = json.loads(line)
        if isinstance(found, dict):
            return found
    raise FileUnreadable(path=path, reason="it is not the state of a process")


def _replay(record: ProcessRecord, lines: list[dict[str, Any]], path: Path) -> None:
    try:
        for line in lines:
            record.apply(line)
    except (KeyError, TypeError) as error:
        raise FileUnreadable(path=path, reason="it is not the state of a process") from error


Tell = Callable[[ProcessStep, StepProgress | StepEnd], None]
"""Called for every report and every result."""

_OVER = frozenset({ProcessStepState.DONE, ProcessStepState.SKIPPED})


class FleetProcessRunner:
    """Carries out the process of a record through the supervisor `lab`."""

    def __init__(self, record: ProcessRecord, lab: Supervisor, tell: Tell | None = None) -> None:
        self._record = record
        self._lab = lab
        self._tell = tell or (lambda _step, _report: None)
        self._sorter = record.process.sorter()
        self._ready: list[str] = []
        self._busy: dict[str, asyncio.Task[None]] = {}

    async def run(self) -> None:
        """Carry out the remaining steps.

        Raises `DecisionNeeded` if a failed step blocks the rest, `ProcessAborted` if a person ended the process.
        """
        self._record.require_not_aborted()
        self._sorter.prepare()
        try:
            while self._sorter.is_active():
                self._begin()
                if self._busy:
                    await self._next()
                else:
                    raise self._decision_needed()
        finally:
            for task in self._busy.values():
                task.cancel()
            await asyncio.gather(*self._busy.values(), return_exceptions=True)

    def _begin(self) -> None:
        """Start every step that can start."""
        while found := self._sorter.get_ready():
            self._ready.extend(found)
            for id_ in found:
                self._pass(id_)
        for id_ in sorted(self._ready, key=self._rank):
            step = self._record.process.steps[id_]
            if step.robot not in self._busy and self._record.entries[id_].state is not ProcessStepState.FAILED:
                self._ready.remove(id_)
                self._busy[step.robot] = asyncio.create_task(self._carry_out(step), name=f"step {id_}")

    def _rank(self, id_: str) -> tuple[bool, int]:
        """Return the rank of a step among those of its robot: sent steps first, then in the order of the file."""
        return self._record.entries[id_].state is not ProcessStepState.SENT, list(self._record.entries).index(id_)

    def _pass(self, id_: str) -> None:
        """Release the steps after a step that is done or skipped."""
        if id_ in self._ready and self._record.entries[id_].state in _OVER:
            self._ready.remove(id_)
            self._sorter.done(id_)

    async def _next(self) -> None:
        """Wait until a step ends."""
        done, _ = await asyncio.wait(self._busy.values(), return_when=asyncio.FIRST_COMPLETED)
        for robot, task in tuple(self._busy.items()):
            if task in done:
                del self._busy[robot]
                task.result()

    async def _carry_out(self, step: ProcessStep) -> None:
        sent = self._send(step)
        async for report in sent:
            self._tell(step, report)
        result = await sent.outcome()
        self._record.ended(step.id, result)
        self._tell(step, result)
        self._ready.append(step.id)
        self._pass(step.id)

    def _send(self, step: ProcessStep) -> Step:
        entry = self._record.entries[step.id]
        if entry.state is not ProcessStepState.SENT or entry.id is None or entry.text is None:
            id_ = str(uuid4())
            deadline = self._record.process.deadline
            text = command_text(id_, step.robot, step.command, step.args, deadline, self._lab.name)
            self._record.sent(step.id, id_, text)
            return self._lab.send(id_, step.robot, text)
        return self._lab.send(entry.id, step.robot, entry.text)

    def _decision_needed(self) -> DecisionNeeded:
        id_ = self._record.failed()[0]
        result = self._record.entries[id_].result
        assert result is not None
        robot = self._record.process.steps[id_].robot
        return DecisionNeeded(step=id_, robot=robot, error_code=result.code, error=result.error)
