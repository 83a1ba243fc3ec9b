"""`maya dmc fault` finds running virtual controllers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from maya_un.cli.dmc_tools.fault import ServedTwin, chosen, published, served
from maya_un.errors import TwinNotFound

OWN = os.getpid()


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "maya"))
    return tmp_path / "maya"


def _write(place: Path, name: str, value: object) -> None:
    place.mkdir(exist_ok=True)
    (place / name).write_text(json.dumps(value), encoding="utf-8")


def _gone() -> int:
    """Return the number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_a_twin_is_found_while_it_is_served(place: Path) -> None:
    assert served() == []
    twin = ServedTwin("127.0.0.1", 5023, 4000, OWN)
    with published(twin):
        assert served() == [twin]
        assert {chosen(named).address for named in (None, "5023", "127.0.0.1:5023")} == {"127.0.0.1:5023"}
    assert (served(), list(place.iterdir())) == ([], [])


@pytest.mark.usefixtures("place")
def test_which_one_must_be_clear() -> None:
    with pytest.raises(TwinNotFound, match="none runs"):
        chosen(None)
    with published(ServedTwin("127.0.0.1", 5023, 4000, OWN)), pytest.raises(TwinNotFound, match=r"at 5024.*:5023"):
        chosen("5024")


def test_of_several_one_must_be_named(place: Path) -> None:
    _write(place, "twin-1.json", ServedTwin("127.0.0.1", 5024, 4001, OWN)._asdict())
    with published(ServedTwin("127.0.0.1", 5023, 4000, OWN)):
        assert [twin.port for twin in served()] == [5023, 5024]
        assert chosen("5024").address == "127.0.0.1:5024"
        with pytest.raises(TwinNotFound, match="several run"):
            chosen(None)


@pytest.mark.parametrize("value", [{}, [], 5, None, {"host": "h", "port": "x", "control": 1, "pid": OWN}])
def test_foreign_file_is_skipped(place: Path, value: object) -> None:
    _write(place, "twin-5.json", value)
    assert served() == []


def test_killed_twin_is_not_listed(place: Path) -> None:
    _write(place, "twin-5.json", ServedTwin("127.0.0.1", 5023, 4000, _gone())._asdict())
    assert served() == []
