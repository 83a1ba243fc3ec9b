"""The recorder beside a robot: it hears everything, and saves it when something goes wrong, once."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from maya_un.config import RecorderConfig
from maya_un.errors import FileUnwritable, InternalError
from maya_un.events import EmergencyStopped, Event, FaultEntered, JobAdvanced, RecordingSaved
from maya_un.recorder import mcap_file, recorder
from maya_un.recorder.recording import Recording
from maya_un.schema.robot import Kept
from maya_un.testing import faults
from maya_un.values import Joints
from tests.recorded import UTC, Recorded, recorded, recording_store
from tests.virtual_time import elapse

THERE = Joints(0.4, 1.45, 1.35)


def saved(robot: Recorded) -> list[Kept]:
    assert robot.recorder.store is not None
    return robot.recorder.store.list()


def read(robot: Recorded, kept: Kept) -> Recording:
    assert robot.recorder.store is not None
    return mcap_file.read(robot.recorder.store.path(kept.name))


def events_of(robot: Recorded) -> list[Event]:
    return [event for event in robot.controller.events.since(0) if isinstance(event, RecordingSaved)]


async def test_states_events_and_the_wire_are_recorded() -> None:
    async with recorded() as robot:
        await robot.controller.move(THERE)
        await elapse(1.0)
        taken = robot.recorder.taken("asked")
        events = robot.controller.events.since(0)
    assert list(taken.events) == events
    assert taken.states[-1].joints is not None
    assert taken.states[-1].joints == pytest.approx(THERE, abs=1e-5)
    moving = [state for state in taken.states if state.moving]
    assert len(moving) > 20
    said = b"".join(piece.data for piece in taken.wire if piece.side == "client")
    assert b"BGS\r" in said
    assert said.startswith(b"DP ")
    opens = [piece.link for piece in taken.wire if piece.event == "open"]
    assert opens == [1, 2]
    assert taken.header.complete
    assert taken.header.firmware == "DMC4133 Rev 1.3k"


async def test_requested_recording_is_saved_and_announced(tmp_path: Path) -> None:
    async with recorded(tmp_path) as robot:
        await elapse(1.0)
        turn = sys.getswitchinterval()
        kept = await robot.recorder.save()
        assert sys.getswitchinterval() == turn
        assert saved(robot) == [kept]
        (event,) = events_of(robot)
        assert kept is not None
        assert event.detail == {"reason": "asked", "name": kept.name, "bytes": kept.bytes}
        taken = read(robot, kept)
    assert taken.header.cause == recorder.NOBODY
    assert taken.header.utc == UTC
    assert taken.states
    assert taken.wire


async def test_a_fault_is_saved_once_with_the_seconds_after_it(tmp_path: Path) -> None:
    async with recorded(tmp_path) as robot:
        await elapse(20.0)
        with faults.abort_input(robot.virtual):
            await elapse(1.0)
            at = robot.controller.events.since(0)[-1].time
            assert saved(robot) == []
            await elapse(30.0)
        (kept,) = saved(robot)
        taken = read(robot, kept)
    fault = next(event for event in taken.events if event.code)
    assert kept.reason == fault.kind
    assert (taken.header.cause.seq, taken.header.cause.code) == (fault.seq, fault.code)
    assert taken.header.cause.message
    assert taken.span[0] <= at - 10.0
    assert taken.header.saved == pytest.approx(at + 5.0, abs=0.01)
    assert taken.states[-1].time > at + 4.5
    assert taken.states[-1].fault is not None


async def test_faults_that_follow_each_other_are_one_recording(tmp_path: Path) -> None:
    async with recorded(tmp_path) as robot:
        for number in range(4):
            robot.controller.events.emit(FaultEntered(message=f"{number}", code=2305))
            await elapse(4.0)
        await elapse(60.0)
        (kept,) = saved(robot)
        assert read(robot, kept).header.cause.message == "0"
        robot.controller.events.emit(FaultEntered(message="late", code=2305))
        await elapse(6.0)
        assert len(saved(robot)) == 2


async def test_endless_series_of_faults_is_saved(tmp_path: Path) -> None:
    async with recorded(tmp_path) as robot:
        for _ in range(40):
            robot.controller.events.emit(FaultEntered(message="again", code=2305))
            await elapse(1.0)
        assert len(saved(robot)) == 1
        assert events_of(robot)[0].time < 31.0


async def test_event_without_an_error_is_not_saved(tmp_path: Path) -> None:
    async with recorded(tmp_path) as robot:
        await robot.controller.stop()
        robot.controller.events.emit(JobAdvanced(1, "refused", "failed", "ana", code=2102))
        await elapse(30.0)
    assert saved(robot) == []


async def test_a_fault_at_the_very_end_is_saved_without_waiting(tmp_path: Path) -> None:
    async with recorded(tmp_path) as robot:
        robot.controller.events.emit(EmergencyStopped(message="pressed", code=2303))
    (kept,) = saved(robot)
    assert kept.reason == "estop"


async def test_a_defect_that_ends_the_program_is_saved(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        async with recorded(tmp_path):
            await elapse(3.0)
            raise ZeroDivisionError("of ours")
    (kept,) = recording_store(tmp_path).list()
    assert kept.reason == "crash"
    cause = mcap_file.read(recording_store(tmp_path).path(kept.name)).header.cause
    assert (cause.kind, cause.message) == ("ZeroDivisionError", "of ours")


async def test_refusal_that_ends_the_program_is_no_crash(tmp_path: Path) -> None:
    with pytest.raises(InternalError):
        async with recorded(tmp_path):
            raise InternalError(reason="told already")
    assert recording_store(tmp_path).list() == []


async def test_without_a_folder_nothing_is_saved() -> None:
    async with recorded() as robot:
        assert await robot.recorder.save() is None
        robot.controller.events.emit(FaultEntered(message="…", code=2305))
        await elapse(30.0)
        assert events_of(robot) == []


async def test_full_disk_is_reported_and_harms_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    async with recorded(tmp_path / "file" / "recordings") as robot:
        robot.controller.events.emit(FaultEntered(message="…", code=2305))
        await elapse(6.0)
        (event,) = events_of(robot)
        assert event.code == FileUnwritable.code
        with pytest.raises(FileUnwritable):
            await robot.recorder.save()
        await robot.controller.move(THERE)


async def test_defect_of_the_recorder_harms_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: Recording, __: object) -> None:
        raise ZeroDivisionError("of the recorder")

    monkeypatch.setattr(mcap_file, "write", broken)
    async with recorded(tmp_path) as robot:
        robot.controller.events.emit(FaultEntered(message="…", code=2305))
        await elapse(6.0)
        with pytest.raises(InternalError, match="of the recorder"):
            await robot.recorder.save()
        assert [event.code for event in events_of(robot)] == [InternalError.code] * 2
        await robot.controller.move(THERE)
        robot.controller.events.emit(FaultEntered(message="at the end", code=2305))
    assert [event.code for event in events_of(robot)] == [InternalError.code] * 3
    assert saved(robot) == []


async def test_however_long_ago_the_controller_was_configured_that_is_kept(tmp_path: Path) -> None:
    async with recorded(tmp_path, settings=RecorderConfig(seconds=20.0)) as robot:
        await elapse(60.0)
        kept = await robot.recorder.save()
        assert kept is not None
        taken = read(robot, kept)
    assert not taken.header.complete
    begin, end = taken.span
    assert 20.0 <= end - begin <= 21.0
    opening = [piece for piece in taken.wire if piece.time < taken.header.whole]
    said = b"".join(piece.data for piece in opening if piece.side == "client")
    assert b"_SPA" in said or b"SPA=" in said
    assert b"DL" in said
    assert max(piece.time for piece in opening) <= taken.header.opening
    assert all(state.time >= taken.header.whole for state in taken.states)


async def test_remains_of_a_killed_process_are_removed_at_the_next_start(tmp_path: Path) -> None:
    draft = tmp_path / "2026-11-21T19-25-20Z-limit.mcap.part"
    draft.write_bytes(b"half")
    async with recorded(tmp_path):
        assert not draft.exists()
