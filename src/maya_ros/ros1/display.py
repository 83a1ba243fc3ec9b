"""Starts programs that open windows; without a display it prints one line, and the rest of a launch runs."""

from __future__ import annotations

import os
import shutil
import socket
import sys
from collections.abc import Mapping

PATIENCE = 2.0
"""Longest wait for a display to accept a connection [s]."""

NAME = "__name:="
"""Prefix of a node's name among the arguments of roslaunch."""


def main() -> int:
    """Become the program that the arguments name; without the program or a display, print why and return 0."""
    program, *arguments = sys.argv[1:]
    reason = no_display(os.environ)
    if reason is None and shutil.which(program) is None:
        reason = f"it is not installed (apt-get install {program})"
    if reason is not None:
        name = next((word.removeprefix(NAME) for word in arguments if word.startswith(NAME)), program)
        print(f"{name} is left out: {reason}. Everything else runs.", flush=True)
        return 0
    return os.execvp(program, [program, *arguments])


def no_display(environment: Mapping[str, str]) -> str | None:
    """Return why no window can be opened in an environment, None if one can.

    A platform for Qt in $QT_QPA_PLATFORM is respected.
    """
    if environment.get("QT_QPA_PLATFORM", "xcb") != "xcb" or environment.get("WAYLAND_DISPLAY"):
        return None
    name = environment.get("DISPLAY", "")
    if not name:
        return "there is no display ($DISPLAY is not set)"
    host, _, number = name.rpartition(":")
    try:
        _knock(host, int(number.partition(".")[0]))
    except (OSError, ValueError) as error:
        return f"the display {name} does not answer ({error})"
    return None


def _knock(host: str, number: int) -> None:
    """Connect to an X server as its clients do: by a socket of this machine if no host is named, else by TCP."""
    if host in {"", "unix"}:
        with socket.socket(socket.AF_UNIX) as display:
            display.settimeout(PATIENCE)
            display.connect(f"/tmp/.X11-unix/X{number}")
    else:
        socket.create_connection((host, 6000 + number), PATIENCE).close()
