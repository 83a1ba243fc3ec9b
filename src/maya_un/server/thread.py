"""The HTTP server in a thread of its own, with an ordinary event loop: its timeouts are real seconds."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import uvicorn
from fastapi import FastAPI

from maya_un.errors import AddressInUse

LOOPBACK = "127.0.0.1"


class _Server(uvicorn.Server):
    """Says when it listens, and lets the main thread keep the signals."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.listening = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to listen."""
        await super().startup(sockets)
        self.listening.set()


def bound_socket(port: int) -> socket.socket:
    """Return a listening place on loopback (`port` 0: any free one); raises `AddressInUse`."""
    door = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        door.bind((LOOPBACK, port))
    except OSError as error:
        door.close()
        raise AddressInUse(address=f"{LOOPBACK}:{port}") from error
    return door


@asynccontextmanager
async def served(app: FastAPI, door: socket.socket) -> AsyncIterator[str]:
    """Serve `app` at `door` while the block runs; yields its URL.

    The calling loop goes on while the thread starts and ends.
    """
    config = uvicorn.Config(
        app, log_config=None, access_log=False, lifespan="off", timeout_graceful_shutdown=1, loop="asyncio"
    )
    server = _Server(config)
    thread = threading.Thread(target=server.run, args=([door],), name="maya-http", daemon=True)
    loop = asyncio.get_running_loop()
    port = door.getsockname()[1]
    thread.start()
    try:
        await loop.run_in_executor(None, server.listening.wait, 10.0)
        yield f"http://{LOOPBACK}:{port}"
    finally:
        server.should_exit = True
        await loop.run_in_executor(None, thread.join)
        door.close()
