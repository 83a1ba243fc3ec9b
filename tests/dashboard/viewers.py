"""Viewers of the dashboard without a browser: clients of the stream with the subscriptions of a page.

`python -m tests.dashboard.viewers PORT COUNT STALLED` prints "here" when all of them get states, and runs until it is
killed. The stalled ones then read no more.
"""

from __future__ import annotations

import asyncio
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tests.conventions.source import ROOT
from tests.stream_readers import UPGRADE, frame

TOPICS = ("queue", "motion", "link", "signals", "margins", "table", "can")
SUBSCRIPTION = {
    "type": "subscribe",
    "state": {"rate": 20},
    "events": {"since": 0},
    **dict.fromkeys(TOPICS, True),
}
"""Of a page that is visible (web/src/stream/stream.ts)."""


async def view(port: int, here: asyncio.Event, *, stalled: bool) -> None:
    """Look on, or stop reading after the first state."""
    line = socket.create_connection(("127.0.0.1", port))
    line.setblocking(False)
    if stalled:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    reader, writer = await asyncio.open_connection(sock=line, limit=4096)
    writer.write(UPGRADE)
    await reader.readuntil(b"\r\n\r\n")
    writer.write(frame(SUBSCRIPTION))
    while piece := await reader.read(1 << 16):
        if b'"state"' in piece:
            here.set()
        if stalled and here.is_set():
            await asyncio.Future()


async def main(port: int, count: int, stalled: int) -> None:
    """Have all of them look on."""
    async with asyncio.TaskGroup() as viewers:
        here = [asyncio.Event() for _ in range(count + stalled)]
        for number, one in enumerate(here):
            viewers.create_task(view(port, one, stalled=number >= count))
        for one in here:
            await one.wait()
        print("here", flush=True)


@contextmanager
def looking_on(port: int, count: int, stalled: int) -> Iterator[None]:
    """Have viewers look on while the block runs, in a process of their own."""
    command = [sys.executable, "-m", "tests.dashboard.viewers", str(port), str(count), str(stalled)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT) as viewers:
        try:
            assert viewers.stdout is not None
            assert viewers.stdout.readline() == b"here\n"
            yield
            assert viewers.poll() is None, "a viewer was cut off"
        finally:
            viewers.kill()


if __name__ == "__main__":
    asyncio.run(main(*map(int, sys.argv[1:])))
