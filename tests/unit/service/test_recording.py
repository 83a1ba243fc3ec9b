"""The recordings in the service."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from dmc41x3.loops import run_virtual
from maya_un.assembly.stack import stack
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.errors import InvalidRequest, NotFound
from maya_un.events import Connected
from maya_un.recorder import mcap_file
from maya_un.service.access.operations import LOCAL
from maya_un.service.queueing import RecordingService
from tests.recorded import recorded, recording_store
from tests.virtual_time import elapse


async def test_a_recording_is_saved_listed_and_found(tmp_path: Path) -> None:
    async with stack(Config(), recordings=recording_store(tmp_path), seed=5) as robot:
        room = robot.service.recorder
        assert room.list() == []
        await elapse(1.0)
        kept = await room.save(replace(LOCAL, name="ana"))
        assert room.list() == [kept]
        taken = mcap_file.read(room.path(kept.name))
    assert (kept.reason, taken.header.cause.message) == ("asked", "asked by ana")
    source = taken.header.origin.twin
    assert source is not None
    assert source.seed == 5
    assert taken.wire[0].event == "open"
    assert isinstance(taken.events[0], Connected)


async def test_a_fault_of_the_whole_stack_is_saved(tmp_path: Path) -> None:
    async with stack(Config(), recordings=recording_store(tmp_path)) as robot:
        assert robot.twin is not None
        await elapse(12.0)
        robot.twin.controller.cut()
        await elapse(10.0)
        (kept,) = robot.service.recorder.list()
        taken = mcap_file.read(robot.service.recorder.path(kept.name))
    assert kept.reason == "disconnected"
    assert taken.header.cause.code == 1001
    assert [piece.event for piece in taken.wire if piece.event] == ["open", "end", "open"]


@pytest.mark.parametrize("how", ["dry", "disabled", "nowhere"])
def test_missing_recorder_is_reported(how: str, tmp_path: Path) -> None:
    run_virtual(_refused(how, tmp_path))
    assert list(tmp_path.iterdir()) == []


async def _refused(how: str, tmp_path: Path) -> None:
    config = parse({"recorder": {"enabled": how != "disabled"}})
    recordings = None if how == "nowhere" else recording_store(tmp_path)
    async with stack(config, recordings=recordings, live=how != "dry") as robot:
        assert robot.service.recorder.list() == []
        with pytest.raises(InvalidRequest, match="nothing is recorded here"):
            await robot.service.recorder.save()
        with pytest.raises(NotFound):
            robot.service.recorder.path("2026-11-21T19-25-20Z-asked.mcap")


async def test_a_recorder_that_keeps_no_files_has_no_recordings() -> None:
    async with recorded() as robot:
        room = RecordingService(robot.recorder)
        assert room.list() == []
        with pytest.raises(InvalidRequest):
            await room.save()
        with pytest.raises(NotFound):
            room.path("2026-11-21T19-25-20Z-asked.mcap")
