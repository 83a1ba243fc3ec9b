"""Checks of this computer without a robot."""

from __future__ import annotations

import asyncio
import os
import shutil
import socket
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import pytest

from maya_un import __version__, runtime
from maya_un.http.doctor import host
from maya_un.http.doctor.finding import Finding
from maya_un.http.doctor.host import ListeningProcess, listeners
from maya_un.process.journal.protocol import EventRow
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.diagnosis import FindingOutcome


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("MAYA_CONFIG", raising=False)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = tmp_path / "kept"
    monkeypatch.setenv("MAYA_STATE_DIR", str(place))
    return place


def only(findings: Iterator[Finding]) -> Finding:
    (found,) = findings
    return found


def keep(folder: Path, date: str = "2026-11-21T10:00:00+00:00") -> None:
    async def write() -> None:
        journal = await SqliteJournal.open(folder / "maya.db")
        journal.note(EventRow(1, 1, date, 0.0, "homed", 0, {}))
        await journal.close()

    asyncio.run(write())


def test_a_configuration_is_good_absent_or_wrong(tmp_path: Path) -> None:
    assert only(host.config(None, "en")).key == "config_none"
    file = tmp_path / "maya.toml"
    file.write_text("[cell]\ngrasp_height = 0.4\n")
    assert only(host.config(file, "en")).key == "config_good"
    file.write_text("[cell]\ngrasp_hight = 0.4\n")
    wrong = only(host.config(file, "en"))
    assert (wrong.outcome, "grasp_hight" in wrong.details["error"]) == (FindingOutcome.FAIL, True)


def test_storage_that_is_well_is_looked_at_whole(folder: Path) -> None:
    assert only(host.storage("en", served_by=0)).key == "storage_none"
    assert not folder.exists(), "a look must not make anything"
    keep(folder)
    keep(folder)
    found = only(host.storage("en", served_by=0))
    assert (found.key, found.details["runs"]) == ("storage_good", 2)
    assert only(host.storage("en", served_by=7)).key == "storage_in_use"


def test_damaged_storage_is_reported_as_damaged(folder: Path) -> None:
    keep(folder)
    file = folder / "maya.db"
    data = bytearray(file.read_bytes())
    data[len(data) // 2 :] = os.urandom(len(data) - len(data) // 2)
    file.write_bytes(data)
    found = only(host.storage("en", served_by=0))
    assert (found.outcome, found.key) == (FindingOutcome.FAIL, "storage_bad")
    file.write_bytes(b"somebody else's file" * 100)
    assert only(host.storage("en", served_by=0)).outcome is FindingOutcome.FAIL


def test_folder_that_cannot_be_made_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "file" / "kept"))
    assert only(host.storage("en", served_by=0)).key == "storage_unwritable"


class _Usage(NamedTuple):
    total: int
    used: int
    free: int


@pytest.mark.parametrize(
    ("free", "outcome"),
    [(5e9, FindingOutcome.OK), (1e9, FindingOutcome.WARN), (1e8, FindingOutcome.FAIL), (0.0, FindingOutcome.FAIL)],
)
@pytest.mark.usefixtures("folder")
def test_free_space_on_the_disk(free: float, outcome: FindingOutcome, monkeypatch: pytest.MonkeyPatch) -> None:
    def usage(_: Path) -> _Usage:
        return _Usage(0, 0, int(free))

    monkeypatch.setattr(shutil, "disk_usage", usage)
    assert only(host.disk()).outcome is outcome


def test_ports_are_free_ours_or_taken() -> None:
    there = [
        ListeningProcess(4133, 12, "python"),
        ListeningProcess(9090, 0, ""),
        ListeningProcess(11311, 13, "rosmaster"),
    ]
    found = {finding.details["port"]: finding for finding in host.ports(there)}
    assert {port: finding.key for port, finding in found.items()} == {
        3000: "port_free",
        4133: "port_taken",
        5023: "port_free",
        9090: "port_taken",
        11311: "port_ours",
    }
    assert found[4133].details["who"] == "python (process 12)"
    runtime.publish(runtime.Running("http://127.0.0.1:4133", 12, None))
    assert next(one for one in host.ports(there) if one.details["port"] == 4133).key == "port_ours"


def test_listening_program_is_named_by_the_system() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        (found,) = [one for one in listeners() if one.port == port]
        assert found.pid == os.getpid()
        assert found.name
    assert not [one for one in listeners() if one.port == port]


def test_system_without_that_information_has_no_listeners(tmp_path: Path) -> None:
    assert listeners(tmp_path) == []


def test_the_clock_is_kept_alone_or_behind(folder: Path, tmp_path: Path) -> None:
    now = datetime(2026, 11, 21, 10, 0, tzinfo=UTC)
    assert only(host.clock(now, tmp_path)).key == "clock_alone"
    mark = tmp_path / "run" / "chrony" / "chronyd.pid"
    mark.parent.mkdir(parents=True)
    mark.touch()
    assert only(host.clock(now, tmp_path)).details == {"keeper": "chrony"}
    keep(folder, (now + timedelta(hours=1)).isoformat())
    behind = only(host.clock(now, tmp_path))
    assert (behind.outcome, behind.details["seconds"]) == (FindingOutcome.FAIL, 3600.0)
    assert only(host.clock(now + timedelta(hours=2), tmp_path)).key == "clock_good"


def test_ros_is_looked_for_and_its_master_called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not Path("/opt/ros").is_dir() and shutil.which("roscore") is None:
        assert only(host.ros()).outcome is FindingOutcome.SKIPPED
    roscore = tmp_path / "roscore"
    roscore.touch(mode=0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        uri = f"http://127.0.0.1:{listener.getsockname()[1]}"
        monkeypatch.setenv("ROS_MASTER_URI", uri)
        assert only(host.ros()).key == "ros_master"
    named = only(host.ros())
    assert (named.key, named.outcome) == ("ros_no_master", FindingOutcome.WARN)
    monkeypatch.setattr(host, "LOCAL_MASTER", uri)
    assert only(host.ros()).outcome is FindingOutcome.SKIPPED


def test_the_software_is_compiled_or_not() -> None:
    assert only(host.software("numpy._core._multiarray_umath")).key == "software_compiled"
    assert only(host.software("maya_un.http.doctor.host")).key == "software_plain"
    assert only(host.software()).details == {"version": __version__}
