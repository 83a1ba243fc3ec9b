"""The progress that a command shows on a terminal while it computes."""

from __future__ import annotations

import io
import os
import pty
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from maya_un.cli.progress import ComputationLine, Display, computing
from maya_un.cli.settings import OutputSettings

JOB = "parts: {cube: [0.5, 1.1, 0.4]}\nsteps: [home, {pick: cube}]\n"


class Screen(io.StringIO):
    """A terminal in memory."""

    def isatty(self) -> bool:
        """Be one."""
        return True


def screen_of(monkeypatch: pytest.MonkeyPatch) -> Screen:
    """Return the error stream, which is a terminal from now on; a fixture could not replace pytest's own."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(sys, "stderr", screen := Screen())
    return screen


def test_the_current_part_is_shown_and_removed(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = screen_of(monkeypatch)
    with computing("Dry run", OutputSettings(language="en")) as display:
        display.note("   3 pick [cube]: executing")
        display.reached(0.5)
    shown = screen.getvalue()
    assert "Dry run: 3 pick [cube]: executing" in shown
    assert shown.endswith("\x1b[1A\x1b[2K")  # the line is erased


@pytest.mark.parametrize("settings", [OutputSettings(json=True), OutputSettings()])
def test_nothing_is_shown_without_a_person(settings: OutputSettings, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", Screen() if settings.json else io.StringIO())
    assert type(computing("Dry run", settings)) is Display


def test_the_line_is_in_the_language_of_the_person(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = screen_of(monkeypatch)
    display = computing("Drawing the picture", OutputSettings(language="es"))
    assert isinstance(display, ComputationLine)
    with display:
        pass
    assert "Dibujando la imagen" in screen.getvalue()


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("plot workspace --output {folder}/p.svg", "Drawing the picture"),
        ("run --dry-run {job} --address sim", "Dry run"),
    ],
)
def test_a_command_that_computes_tells_a_terminal(line: str, shown: str, tmp_path: Path) -> None:
    job = tmp_path / "job.yaml"
    job.write_text(JOB)
    command = [str(Path(sys.executable).with_name("maya")), *line.format(folder=tmp_path, job=job).split()]
    ours, theirs = pty.openpty()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs, env={**os.environ, "TERM": "xterm"}) as run:
        os.close(theirs)
        said = b""
        with suppress(OSError):  # the terminal has no writer any more
            while data := os.read(ours, 4096):
                said += data
        os.close(ours)
        assert run.stdout is not None
        printed = run.stdout.read().decode()
    assert run.returncode == 0
    assert shown.encode() in said
    assert "\x1b" not in printed
