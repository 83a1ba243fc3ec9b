"""The word of a service under systemd: ready, still alive, ending (sd_notify(3)); silent without a supervisor."""

from __future__ import annotations

import asyncio
import os
import socket
from contextlib import suppress


def tell(words: str) -> None:
    """Say something like "READY=1" at $NOTIFY_SOCKET; where nobody listens nothing happens."""
    place = os.environ.get("NOTIFY_SOCKET", "")
    if not place.startswith(("/", "@")):
        return
    address = f"\0{place[1:]}" if place.startswith("@") else place
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as mouth:
        mouth.sendto(words.encode(), address)


def interval() -> float | None:
    """Return how often the supervisor wants to hear that this process lives [s, real time], None where never.

    Half of $WATCHDOG_USEC, as sd_watchdog_enabled(3) advises.
    """
    meant = os.environ.get("WATCHDOG_PID", str(os.getpid()))
    microseconds = os.environ.get("WATCHDOG_USEC", "")
    if meant != str(os.getpid()) or not microseconds.isdecimal() or int(microseconds) == 0:
        return None
    return int(microseconds) / 2e6


async def stay_alive(speed: float) -> None:
    """Say again and again that the running loop, whose clock runs `speed` times as fast, is alive; until cancelled."""
    every = interval()
    while every is not None:
        tell("WATCHDOG=1")
        await asyncio.sleep(every * speed)
