"""`maya up --open` opens the dashboard in the default browser; `$BROWSER` names it."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from tests.system.processes import CALM, Process, running
from tests.waiting import eventually

pytestmark = pytest.mark.system

UP = f"up --port 0 --journal memory --open {CALM}"


def ended(process: Process) -> int:
    process.send(signal.SIGTERM)
    return process.end()[0]


def test_open_shows_the_dashboard_in_the_browser(tmp_path: Path) -> None:
    opened, browser = tmp_path / "opened", tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {opened}.new\nmv {opened}.new {opened}\n')
    browser.chmod(0o755)
    with running(UP, {"BROWSER": str(browser)}) as process:
        url = process.until("Dashboard: ").rpartition(" ")[2]
        eventually(opened.exists, "the page in the browser")
        assert ended(process) == 0
    assert opened.read_text() == url


def test_service_runs_without_a_browser() -> None:
    with running(UP, {"BROWSER": "/bin/false"}) as process:
        url = process.until("Dashboard: ").rpartition(" ")[2]
        assert url in process.until("No browser opens")
        assert ended(process) == 0


def test_browser_in_the_terminal_stays_closed(tmp_path: Path) -> None:
    browser = tmp_path / "lynx"
    browser.write_text(f"#!/bin/sh\ntouch {tmp_path}/opened\n")
    browser.chmod(0o755)
    with running(UP, {"BROWSER": str(browser)}) as process:
        process.until("No browser opens")
        assert ended(process) == 0
    assert not (tmp_path / "opened").exists()
