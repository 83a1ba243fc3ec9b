"""Ports for programs that need a given port, or keep one over a restart."""

from __future__ import annotations

import socket
from random import SystemRandom

_FIRST, _BEYOND = 15_000, 32_000
"""Below the ports that a system gives to connections: one of those may take a port between its choice and its use."""


def free_port() -> int:
    """Return a TCP port of the loopback that nobody has, and that most likely nobody else takes soon."""
    while True:
        port = SystemRandom().randrange(_FIRST, _BEYOND)
        with socket.socket() as tried:
            try:
                tried.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
