"""One command that asks for the state: `maya status` beside bluesky-queueserver's `qserver status`.

Each has its server beside it. qserver's needs a Redis, which runs on a free port of this machine for so long.
"""

from __future__ import annotations

import resource
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.peers.contest import Contest, Floats, LeftOut, Side
from benchmarks.service import MAYA, service
from scripts.performance_results import BARE, OURS

BLUESKY = "bluesky-queueserver"
PATIENCE = 60.0
"""A server must be ready after so long [s]."""


def free_port() -> int:
    """Return a port that is free on this machine."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@contextmanager
def running(command: Sequence[str], folder: str) -> Iterator[None]:
    """Keep a server running for the block, silent."""
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield
        finally:
            process.terminate()


@contextmanager
def queue_server() -> Iterator[Command]:
    """Run Redis and bluesky's queue server; provides the command that asks for its state."""
    redis, qserver = shutil.which("redis-server"), Path(sys.executable).with_name("qserver")
    if redis is None:
        raise LeftOut("bluesky-queueserver needs Debian's redis-server, which is not installed here")
    if not qserver.exists():
        raise LeftOut("bluesky-queueserver is not installed here")
    store, control, publish = free_port(), free_port(), free_port()
    address = f"tcp://127.0.0.1:{control}"
    ask = Command((str(qserver), "status", "--zmq-control-addr", address), None, "'manager_state': 'idle'")
    with tempfile.TemporaryDirectory() as folder, ExitStack() as servers:
        keep = redis, "--bind", "127.0.0.1", "--port", str(store), "--save", "", "--dir", folder
        manage = (
            *(
                str(qserver.with_name("start-re-manager")),
                "--startup-dir",
                folder,
                "--redis-addr",
                f"127.0.0.1:{store}",
            ),
            *("--zmq-control-addr", address, "--zmq-info-addr", f"tcp://127.0.0.1:{publish}"),
        )
        for command in (keep, manage):
            servers.enter_context(running(command, folder))
        deadline = time.monotonic() + PATIENCE
        while not ask.right():
            if time.monotonic() > deadline:
                raise LeftOut(f"bluesky-queueserver was not ready after {PATIENCE:g} s")
        yield ask


@dataclass(frozen=True, slots=True)
class Command:
    """A command line, the environment it runs in, and what a good answer holds."""

    words: Sequence[str]
    environment: Mapping[str, str] | None
    says: str

    def run(self) -> str:
        """Run it and return what it says."""
        done = subprocess.run(self.words, env=self.environment, capture_output=True, text=True, check=False)
        return done.stdout if done.returncode == 0 else ""

    def right(self) -> bool:
        """Whether it gives a good answer now."""
        return self.says in self.run()

    def answer(self) -> Floats:
        """Return 1 for a good answer."""
        return np.array([float(self.right())])

    def wall(self) -> float:
        """Return how long it takes [s]."""
        start = time.perf_counter()
        self.run()
        return time.perf_counter() - start

    def used(self) -> float:
        """Return the CPU time that it takes, that of its server not included [s]."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.run()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


@contextmanager
def contests(left_out: dict[str, str]) -> Iterator[list[Contest]]:
    """Provide the work by wall clock, which a person waits for, and by CPU time; servers run for so long."""
    with ExitStack() as servers:
        ours = servers.enter_context(service())
        asked = {OURS: Command((MAYA, "status"), ours.environment, "not homed")}
        try:
            asked[BLUESKY] = servers.enter_context(queue_server())
        except LeftOut as reason:
            left_out[BLUESKY] = str(reason)
        asked[BARE] = Command((sys.executable, "-c", "pass"), None, "")
        yield [
            Contest("command", "status, time", "ms", "", 0.0, [Side(p, c.answer, c.wall) for p, c in asked.items()]),
            Contest(
                "command", "status, CPU time", "ms", "", 0.0, [Side(p, c.answer, c.used) for p, c in asked.items()]
            ),
        ]
