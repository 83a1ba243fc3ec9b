"""Wishes to the running robot, answered by a service that says what the test wants."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from maya_un.cli import runtime, wishes
from maya_un.cli.display import Display
from maya_un.cli.main import main
from maya_un.cli.runtime import Running
from maya_un.cli.settings import Settings
from maya_un.errors import Stopped
from tests.unit.cli.servers import http_service

PROGRESS = {"phase": "jog", "elapsed": 1.0, "duration": 4.0}


class Seen(Display):
    """Keeps what it is shown, and lets the jog end at the first motion."""

    def __init__(self) -> None:
        self.motions: list[tuple[str, float, float]] = []
        self.shown = threading.Event()

    def motion(self, phase: str, elapsed: float, duration: float) -> None:
        self.motions.append((phase, elapsed, duration))
        self.shown.set()


def test_a_jog_shows_how_far_it_is(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    display = Seen()

    def says(method: str, path: str, body: Any) -> tuple[int, object]:
        if path == "/v1/jog":
            display.shown.wait(10.0)
            return 200, body
        return 200, {"progress": PROGRESS}

    def chosen(_: Settings) -> Display:
        return display

    monkeypatch.setattr(wishes, "chosen", chosen)
    with http_service(says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        assert main(["jog", "b", "20mm"]) == 0
    assert display.motions[0] == ("jog", 1.0, 4.0)
    assert capsys.readouterr().out == "Done.\n"


def test_ctrl_c_stops_a_jog(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    stopped, asked = threading.Event(), list[str]()

    def says(method: str, path: str, _: Any) -> tuple[int, object]:
        asked.append(path)
        if path == "/v1/jog":
            stopped.wait(10.0)
            return 409, {"code": Stopped.code, "details": {}}
        if path == "/v1/stop":
            stopped.set()
        return 200, {"progress": None}

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(wishes, "animate", interrupted)
    with http_service(says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        assert main(["jog", "b", "20mm"]) == 130
    assert "/v1/stop" in asked
    assert "Interrupted" in capsys.readouterr().out
