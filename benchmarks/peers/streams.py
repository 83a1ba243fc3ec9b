"""A state 50 times a second for many readers: Maya's stream beside uvicorn's plain websocket.

Both servers are processes of their own, and the plain one sends what Maya sends, each client by the framework's own
call. The cost is CPU time of the server for one state at one reader; the readers' own work does not count.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator

import numpy as np

from benchmarks.bench_stream import SECONDS, Server
from benchmarks.peers.contest import Contest, Floats, Side
from scripts.performance_results import OURS, Growth

RATE = 50.0
READERS = 100
KINDS = {OURS: "ours", "uvicorn": "bare"}
SHARE = 0.9
"""A reader must get at least this share of the states, in one of `TRIES` samples: the computer has other work too."""

TRIES = 5

SOME = 0.05
"""The same where only the cost of a state counts."""


class Readers:
    """Servers with their readers, which stay connected, and the loop that they are read in."""

    def __init__(self, readers: int, seconds: float = SECONDS, share: float = SHARE) -> None:
        self._loop = asyncio.new_event_loop()
        self._readers = readers
        self._servers = {program: Server(kind, self._loop, readers, RATE) for program, kind in KINDS.items()}
        self._share = share
        for server in self._servers.values():
            server.seconds, server.share = seconds, SOME

    def close(self) -> None:
        """End the servers."""
        for server in self._servers.values():
            server.end()
        self._loop.close()

    def cost(self, program: str) -> float:
        """Return the CPU time of a server for one state at one reader [s]."""
        server = self._servers[program]
        used, _ = server.sample()
        return used * server.seconds / sum(server.received)

    def answer(self, program: str) -> Floats:
        """Return the numbers in the last state that do not change; fails where a reader missed too many states."""
        server = self._servers[program]
        got, tries = 0.0, 0
        while got < self._share and tries < TRIES:
            server.sample()
            got, tries = min(server.received) / (RATE * server.seconds), tries + 1
        assert got >= self._share, f"a reader got {got:.0%} of the states"
        state = json.loads(server.last)["state"]
        return np.array([float(len(state)), *state["counts"][1:]])

    def contest(self) -> Contest:
        """Return the work of so many readers."""
        sides = [
            Side(program, lambda program=program: self.answer(program), lambda program=program: self.cost(program))
            for program in KINDS
        ]
        return Contest("stream", f"a state at one of {self._readers} readers, 50 Hz", "µs", "numbers", 0.0, sides)


def growth(sizes: tuple[int, ...]) -> Iterator[Growth]:
    """Yield the server's CPU time for one state at one of so many readers [µs], the best of three.

    The readers share a process, which need not keep up with all states of hundreds.
    """
    for size in sizes:
        readers = Readers(size)
        try:
            for program in KINDS:
                cost = min(readers.cost(program) for _ in range(3))
                yield Growth("readers at 50 Hz", program, size, 1e6 * cost, "µs CPU per state")
        finally:
            readers.close()
