from __future__ import annotations

from pathlib import Path

import pytest
from prompt_toolkit.history import FileHistory, InMemoryHistory

from dmc41x3.cli.terminal.screen import below, history
from dmc41x3.cli.terminal.session import plain
from maya_un.cli.dmc_tools.site import MAYA
from tests.unit.dmc41x3.cli.bench import say, talking
from tests.virtual_time import elapse


async def test_axes_link_and_keys_are_below_the_line() -> None:
    async with talking() as (session, _, _bench):
        lines = plain(below(session, "", 80)).splitlines()
        assert [line[:1] for line in lines[2:5]] == ["A", "B", "C"]
        assert lines[5] == "bench"
        assert "F12 STOP MOTION" in lines[6]
        assert max(map(len, lines)) <= 80


async def test_the_command_under_the_cursor_is_explained() -> None:
    async with talking() as (session, _, _bench):
        assert plain(below(session, "x=1;SPA=", 80)).startswith("SP  ")
        assert plain(below(session, "x=1;", 80)).startswith("─")


async def test_watched_values_stand_below_the_axes() -> None:
    async with talking() as (session, _, _bench):
        await say(session, ":watch 6*7")
        await elapse(0.5)
        assert plain(below(session, "", 80)).splitlines()[5] == "6*7 42.0000"


async def test_hidden_axes_leave_link_and_keys() -> None:
    async with talking() as (session, _, _bench):
        session.quiet = True
        assert len(below(session, "", 80)) == 3


async def test_programs_and_waiting_lines_are_counted() -> None:
    async with talking() as (session, _, _bench):
        await session.link.driver.download("#A\nWT 60000\nEN\n")
        await say(session, "XQ #A,2")
        await elapse(0.5)
        session.enter("TP")
        session.enter("TP")
        assert below(session, "", 80)[-2] == [("class:letter", "bench   threads 2 run   2 waiting for an answer")]


async def test_old_values_are_marked() -> None:
    async with talking() as (session, _, bench):
        bench.controller.cut()
        await elapse(3.0)
        assert below(session, "", 30)[-2] == [("class:lost", " LINK LOST  bench   F5 connects"[:30])]
        assert session.silence == pytest.approx(3.0, abs=0.3)


def test_the_history_is_the_users_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    kept = history(MAYA.history())
    assert isinstance(kept, FileHistory)
    kept.store_string("TP")
    file = tmp_path / "maya" / "dmc_history"
    assert file.stat().st_mode & 0o777 == 0o600
    assert "+TP" in file.read_text(encoding="utf-8")


def test_a_history_that_cannot_be_kept_is_forgotten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "maya").write_text("a file in the way", encoding="utf-8")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert isinstance(history(MAYA.history()), InMemoryHistory)
