"""The runtime file: how commands and clients find the `maya up` that runs, and the controller it drives.

Imports nothing heavy, because `maya stop` needs it. `maya_un.cli.runtime` writes it.
"""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Any, NamedTuple

_MOST_BYTES = 4096
"""Size of the largest runtime file that can be ours."""


class Running(NamedTuple):
    """A `maya up` as its file describes it; `controller` is host and port, None for a twin in the process."""

    url: str
    pid: int
    controller: tuple[str, int] | None


def folder() -> Path:
    """Return the folder of runtime files: $MAYA_RUNTIME_DIR, else $XDG_RUNTIME_DIR/maya, else /tmp/maya-<uid>."""
    named = os.environ.get("MAYA_RUNTIME_DIR")
    if named:
        return Path(named)
    session = os.environ.get("XDG_RUNTIME_DIR")
    return Path(session) / "maya" if session else Path(f"/tmp/maya-{os.getuid()}")


def find() -> Running | None:
    """Return what the runtime file says, None where there is none that can be read or that we may trust."""
    try:
        return _parse(read(folder() / "service.json"))
    except (ValueError, KeyError, TypeError):
        return None  # a half-written or foreign file is no service


def read(place: Path) -> Any:
    """Return what a runtime file holds, None where there is none that can be read or that we may trust."""
    try:
        found = place.lstat()
        if found.st_uid != os.getuid() or not stat.S_ISREG(found.st_mode) or found.st_size > _MOST_BYTES:
            return None
        return json.loads(place.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None


def _parse(found: dict[str, Any]) -> Running:
    controller = found["controller"]
    address = None if controller is None else (str(controller["host"]), int(controller["port"]))
    return Running(str(found["url"]), int(found["pid"]), address)
