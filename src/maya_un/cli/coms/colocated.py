"""`maya coms` beside `maya up`: a process of its own that ends with it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from urllib.parse import urlsplit

from maya_un.config.model import ComsConfig

_PATIENCE = 5.0
"""It may take so long to end [s]."""


@contextmanager
def coms_beside(rosbridge: str, config: ComsConfig) -> Iterator[None]:
    """Run `maya coms` for the robot behind a rosbridge while the block runs, however the block ends.

    It is connected at once if MAYA_COMS_URL names the supervisors' server.
    """
    port = urlsplit(config.server_address).port
    line = ["coms", "--rosbridge", rosbridge, "--name", config.name, "--port", str(80 if port is None else port)]
    if os.environ.get("MAYA_COMS_URL"):
        line.append("--connect")
    process = subprocess.Popen([sys.executable, "-m", "maya_un.cli.parent_watch", *line], stdin=subprocess.PIPE)
    try:
        yield
    finally:
        assert process.stdin is not None
        process.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            process.wait(_PATIENCE)
        process.kill()
        process.wait()
