"""A display of a test's own, that nobody sees: windows are opened on it, and its picture is read from its memory."""

from __future__ import annotations

import os
import re
import signal
import subprocess
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
"""Rows and columns of red, green and blue, shape (height, width, 3)."""

RVIZ_CRASH = re.compile(rf"\[rviz-\d+\] process has died .*exit code -(?:{signal.SIGABRT:d}|{signal.SIGSEGV:d}),")
"""roslaunch writes this after a crash of rviz. Debian's software renderer sometimes crashes as rviz starts or ends."""

_WIDTH, _HEIGHT, _LINE, _COLOURS = 4, 5, 12, 19


class Display:
    """An X server (Xvfb) until it is closed; its files are kept in `folder`."""

    def __init__(self, folder: Path, width: int = 1280, height: int = 800) -> None:
        self._memory = folder / "Xvfb_screen0"
        reading, writing = os.pipe()
        self._server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{width}x{height}x24", "-fbdir", folder, "-nolisten",
             "tcp", "-noreset", "-nocursor"],
            pass_fds=[writing], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(writing)
        with open(reading, encoding="ascii") as told:  # noqa: PTH123 - a pipe has no path
            number = told.readline().strip()
        if not number:
            self.close()
            raise AssertionError("Xvfb did not start")
        self.name = f":{number}"

    def __enter__(self) -> Display:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    @property
    def environment(self) -> Mapping[str, str]:
        """Settings for programs that draw on it without a graphics card, Qt's among them."""
        return {
            "DISPLAY": self.name,
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "QT_QPA_PLATFORM": "xcb",
            "QT_X11_NO_MITSHM": "1",
        }

    def picture(self) -> Picture:
        """Return what is shown now; the server keeps it in a file of the form that xwd has."""
        raw = self._memory.read_bytes()
        header = np.frombuffer(raw, ">u4", 25)
        height, line = int(header[_HEIGHT]), int(header[_LINE])
        start = int(header[0]) + 12 * int(header[_COLOURS])
        rows = np.frombuffer(raw, np.uint8, height * line, start).reshape(height, line // 4, 4)
        return rows[:, : int(header[_WIDTH]), 2::-1].copy()

    def windows(self) -> list[str]:
        """Return the titles of the windows that are open.

        There may be too few if one closes meanwhile: xwininfo then ends early.
        """
        told = subprocess.run(
            ["xwininfo", "-root", "-tree"],
            env={**os.environ, "DISPLAY": self.name}, stdout=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
        return [line.split('"')[1] for line in told.stdout.splitlines() if line.count('"') >= 2]

    def close(self) -> None:
        """End it."""
        self._server.terminate()
        self._server.wait()
