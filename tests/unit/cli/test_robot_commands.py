"""Commands to the running robot, with a scripted service."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from maya_un import runtime
from maya_un.cli import moving
from maya_un.cli.main import main
from maya_un.cli.progress import Display
from maya_un.cli.settings import OutputSettings
from maya_un.errors import Stopped
from maya_un.runtime import Running
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
            return 200, {**body, "limit": "", "reason": ""}
        return 200, {"progress": PROGRESS}

    def chosen(_: OutputSettings) -> Display:
        return display

    monkeypatch.setattr(moving, "chosen", chosen)
    with http_service(says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        assert main(["jog", "b", "20mm"]) == 0
    assert display.motions[0] == ("jog", 1.0, 4.0)
    assert capsys.readouterr().out == "Moved b by 20.0 mm.\n"


def output_of(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: list[str], answer: object
) -> tuple[str, list[tuple[str, Any]]]:
    """Return what a command line prints when the service answers so, and what it asked."""
    asked: list[tuple[str, Any]] = []

    def says(method: str, path: str, body: Any) -> tuple[int, object]:
        asked.append((path, body))
        return 200, answer

    with http_service(says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        assert main(line) == 0
    return capsys.readouterr().out, asked


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        ({"axis": "a", "distance": -0.5, "limit": "", "reason": ""}, "Moved a by -28.65°.\n"),
        ({"axis": "c", "distance": -4e-5, "limit": "", "reason": ""}, "Moved c by 0.0 mm.\n"),
        (
            {"axis": "r", "distance": 0.3, "limit": "outer", "reason": "it lies outside"},
            "Moved r by 300.0 mm. It stopped because it lies outside.\n",
        ),
    ],
)
def test_a_jog_says_how_far_and_why_no_farther(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], answer: dict[str, object], text: str
) -> None:
    def nothing(*_: object) -> None: ...

    monkeypatch.setattr(moving, "animate", nothing)
    assert output_of(monkeypatch, capsys, ["jog", "r", "-2000mm"], answer) == (
        text,
        [("/v1/jog", {"axis": "r", "distance": -2.0})],
    )


def test_unknown_axis_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["jog", "w", "2mm"]) == 2
    assert "x, y, z, r" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "answer", "text", "asked"),
    [
        (
            ["pause"],
            {"was_moving": True, "duration": 0.882, "distance": [0, 0, 0]},
            "Pausing: at rest within 0.88 s. `maya resume` continues.\n",
            ("/v1/pause", None),
        ),
        (
            ["pause"],
            {"was_moving": False, "duration": 0.0, "distance": [0, 0, 0]},
            "Paused. `maya resume` continues.\n",
            ("/v1/pause", None),
        ),
        (["resume"], {"resumed": True}, "Resumed.\n", ("/v1/resume", None)),
        (["speed", "50%"], {"ratio": 0.5}, "Speed 50 % from now on.\n", ("/v1/speed", {"ratio": 0.5})),
        (["speed", "0.3"], {"ratio": 0.3}, "Speed 30 % from now on.\n", ("/v1/speed", {"ratio": 0.3})),
        (["resume", "--lang", "es"], {"resumed": True}, "Reanudado.\n", ("/v1/resume", None)),
    ],
)
def test_pause_resume_and_speed(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    line: list[str],
    answer: object,
    text: str,
    asked: tuple[str, object],
) -> None:
    assert output_of(monkeypatch, capsys, line, answer) == (text, [asked])


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

    monkeypatch.setattr(moving, "animate", interrupted)
    with http_service(says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        assert main(["jog", "b", "20mm"]) == 130
    assert "/v1/stop" in asked
    assert "Interrupted" in capsys.readouterr().out
