"""A `maya up` of its own for a benchmark: a process on the twin, beside whatever else runs for this user."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

MAYA = str(Path(sys.executable).with_name("maya"))
"""The command beside the Python that runs this."""


class Service(NamedTuple):
    """A running `maya up`: its process, its address, and the environment in which other commands find it."""

    pid: int
    url: str
    environment: dict[str, str]


def alone(folder: str) -> dict[str, str]:
    """Return this environment with `folder` for runtime files, for what is kept and for a user's configuration."""
    own = {"MAYA_RUNTIME_DIR": folder, "MAYA_STATE_DIR": folder, "XDG_CONFIG_HOME": folder, "MAYA_CONFIG": ""}
    return {**os.environ, **own}


@contextmanager
def service(*options: str) -> Iterator[Service]:
    """Run `maya up` with `options` for the length of the block; it is ready when the block begins."""
    with tempfile.TemporaryDirectory() as folder:
        environment = alone(folder)
        command = [MAYA, "up", "--port", "0", *options]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment, text=True
        ) as up:
            try:
                assert up.stdout is not None
                if not up.stdout.readline():
                    raise RuntimeError("maya up ended before it was ready")
                ready = json.loads((Path(folder) / "service.json").read_text(encoding="utf-8"))
                yield Service(up.pid, ready["url"], environment)
            finally:
                up.terminate()
