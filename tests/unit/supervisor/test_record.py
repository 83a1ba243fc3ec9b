from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import cast

import pytest

from maya_un.errors import DecisionNeeded, FileUnreadable, FileUnwritable, ProcessAborted, ProcessChanged, StorageInUse
from maya_un.steps.text import StepEnd
from maya_un.supervisor.lab import Supervisor
from maya_un.supervisor.process import (
    FailureDecision,
    FleetProcess,
    FleetProcessRunner,
    ProcessStep,
    ProcessStepState,
    recorded,
)

PROCESS = FleetProcess("p", {id_: ProcessStep(id_, "MAYA", "home", {}) for id_ in "abc"})
DONE = StepEnd("1", None, None, "x", "y")
FAILED = StepEnd("2", "too far", "2101", "x", "y")


def test_record_is_intact_after_any_end(tmp_path: Path) -> None:
    path = tmp_path / "state"
    with recorded(path, PROCESS) as record:
        record.sent("a", "1", "text 1")
        record.ended("a", DONE)
        record.sent("b", "2", "text 2")
        record.ended("b", FAILED)
        record.sent("c", "3", "text 3")
    whole = path.read_bytes()
    path.write_bytes(whole + b'{"step": "c", "res')  # a crash in the middle of a line
    with recorded(path, PROCESS) as record:
        states = {id_: entry.state for id_, entry in record.entries.items()}
        assert states == {"a": ProcessStepState.DONE, "b": ProcessStepState.FAILED, "c": ProcessStepState.SENT}
        assert (record.entries["c"].id, record.entries["c"].text) == ("3", "text 3")
        assert record.entries["b"].result == FAILED
        assert record.failed() == ["b"]
        assert path.read_bytes() == whole
        record.ended("c", DONE)
        record.decided("b", FailureDecision.RETRY)
    with recorded(path, PROCESS) as record:
        assert [entry.state for entry in record.entries.values()] == [
            ProcessStepState.DONE,
            ProcessStepState.WAITING,
            ProcessStepState.DONE,
        ]
        record.sent("b", "4", "text 4")
        record.ended("b", FAILED)
        record.decided("b", FailureDecision.SKIP)
        assert record.finished


class Disk:
    """A disk with space for a number of bytes: it takes a part of a write, then it is full."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.free = 0
        self._write = os.write
        monkeypatch.setattr("maya_un.supervisor.process.os.write", self.write)

    def write(self, descriptor: int, data: bytes) -> int:
        if not self.free:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        taken = self._write(descriptor, data[: self.free])
        self.free -= taken
        return taken


def test_line_that_does_not_fit_on_the_disk_is_not_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "state"
    with recorded(path, PROCESS) as record:
        whole = path.read_bytes()
        disk = Disk(monkeypatch)
        disk.free = 40
        with pytest.raises(FileUnwritable):
            record.sent("a", "1", "text 1")
        assert record.entries["a"].state is ProcessStepState.WAITING
        assert path.read_bytes() == whole
        disk.free = 10_000
        record.sent("a", "2", "text 2")
    with recorded(path, PROCESS) as record:
        assert record.entries["a"].id == "2"


def test_line_that_the_disk_takes_in_parts_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, write = tmp_path / "state", os.write
    monkeypatch.setattr("maya_un.supervisor.process.os.write", lambda descriptor, data: write(descriptor, data[:7]))
    with recorded(path, PROCESS) as record:
        record.sent("a", "1", "text 1")
    with recorded(path, PROCESS) as record:
        assert (record.entries["a"].id, record.entries["a"].text) == ("1", "text 1")


def test_aborted_process_stays_aborted_until_a_restart(tmp_path: Path) -> None:
    path = tmp_path / "state"
    with recorded(path, PROCESS) as record:
        record.abort()
    with recorded(path, PROCESS) as record, pytest.raises(ProcessAborted):
        record.require_not_aborted()
    with recorded(path, PROCESS, again=True) as record:
        record.require_not_aborted()


async def test_a_failed_step_that_nobody_has_decided_about_sends_nothing_and_is_named(tmp_path: Path) -> None:
    with recorded(tmp_path / "state", PROCESS) as record:
        for id_, result in (("a", DONE), ("b", FAILED), ("c", DONE)):
            record.sent(id_, id_, "text")
            record.ended(id_, result)
        nobody = cast("Supervisor", None)  # a step that is sent would fail here
        with pytest.raises(DecisionNeeded, match=r"Step b of MAYA failed \(2101\): too far .*--retry b") as needed:
            await FleetProcessRunner(record, nobody).run()
    assert needed.value.code == 4047


def test_a_record_belongs_to_its_process_and_to_one_program(tmp_path: Path) -> None:
    path = tmp_path / "state"
    other = FleetProcess("p", {"a": ProcessStep("a", "MAYA2", "home", {})})
    with recorded(path, PROCESS):
        with pytest.raises(StorageInUse), recorded(path, PROCESS):
            pass
        with pytest.raises(StorageInUse), recorded(path, PROCESS, again=True):
            pass
    with pytest.raises(ProcessChanged), recorded(path, other):
        pass


OF_NO_STEP = f'{{"digest": "{PROCESS.digest}"}}\n{{"step": "z"}}\n'


FOREIGN = [
    "hello\n", "[1]\n", "7\n", "\n", '{"process": "p"}\n', '{"steps": []}', "steps:\n- {id: a}\n- {id: b}", "[" * 9000,
]  # fmt: skip


@pytest.mark.parametrize("again", [False, True])
@pytest.mark.parametrize("text", [*FOREIGN, OF_NO_STEP])
def test_invalid_record_file_is_unchanged(tmp_path: Path, text: str, again: bool) -> None:
    path = tmp_path / "state"
    path.write_text(text)
    with pytest.raises((FileUnreadable, ProcessChanged)), recorded(path, PROCESS, again=again):
        pass
    assert path.read_text() == text


def test_record_of_another_process_is_unchanged_until_a_restart(tmp_path: Path) -> None:
    path, text = tmp_path / "state", '{"process": "p", "digest": "other"}\n{"step": "a", "se'
    path.write_text(text)
    with pytest.raises(ProcessChanged), recorded(path, PROCESS):
        pass
    assert path.read_text() == text
    with recorded(path, PROCESS, again=True) as record:
        assert record.entries["a"].state is ProcessStepState.WAITING
    assert path.read_text() == f'{{"process": "p", "digest": "{PROCESS.digest}"}}\n'


@pytest.mark.parametrize("length", [0, 1, 20, 100])
def test_record_begins_again_if_a_crash_left_its_first_line_unfinished(tmp_path: Path, length: int) -> None:
    path = tmp_path / "state"
    with recorded(path, PROCESS):
        pass
    head = path.read_text()
    path.write_text(head[:length].removesuffix("\n"))
    with recorded(path, PROCESS):
        pass
    assert path.read_text() == head


def test_error_of_the_block_is_not_one_of_the_record(tmp_path: Path) -> None:
    with pytest.raises(BrokenPipeError), recorded(tmp_path / "state", PROCESS):
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
