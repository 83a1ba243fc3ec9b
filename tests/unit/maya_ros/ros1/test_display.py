"""Programs that open windows, with a display and without."""

from __future__ import annotations

import socket
import sys

import pytest

from maya_ros.ros1 import display
from maya_ros.ros1.display import no_display


@pytest.mark.parametrize("environment", [{}, {"DISPLAY": ""}, {"QT_QPA_PLATFORM": "xcb"}])
def test_without_a_display_the_reason_is_given(environment: dict[str, str]) -> None:
    assert no_display(environment) == "there is no display ($DISPLAY is not set)"


@pytest.mark.parametrize("environment", [{"QT_QPA_PLATFORM": "offscreen"}, {"WAYLAND_DISPLAY": "wayland-0"}])
def test_a_platform_that_needs_no_x_server_is_taken(environment: dict[str, str]) -> None:
    assert no_display(environment) is None


@pytest.mark.parametrize("name", [":59321", "unix:59321", "127.0.0.1:59321", "nonsense", ":"])
def test_a_display_that_does_not_answer_is_named(name: str) -> None:
    reason = no_display({"DISPLAY": name})
    assert reason is not None
    assert reason.startswith(f"the display {name} does not answer (")


def test_a_display_that_answers_is_used() -> None:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        number = server.getsockname()[1] - 6000
        assert no_display({"DISPLAY": f"127.0.0.1:{number}.0"}) is None


def test_one_line_names_the_node_that_is_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "argv", ["on_display.py", "rosrun", "maya_ui", "maya_ui.py", "__name:=maya_dashboard"])
    assert display.main() == 0
    said = "maya_dashboard is left out: there is no display ($DISPLAY is not set). Everything else runs.\n"
    assert capsys.readouterr().out == said


def test_a_program_that_is_missing_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    monkeypatch.setattr(sys, "argv", ["on_display.py", "no-such-rviz"])
    assert display.main() == 0
    assert "no-such-rviz is left out: it is not installed" in capsys.readouterr().out
