"""The HTTP server in a thread of its own, with an ordinary event loop: its timeouts are real seconds."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.h11_impl import H11Protocol

from maya_un.errors import AddressInUse, InvalidRequest
from maya_un.server.crash import written_down
from maya_un.server.problems import problem
from maya_un.server.stream_wire import Wire

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


class _Protocol(H11Protocol):
    """Answers what is not HTTP with our code, too."""

    def send_400_response(self, msg: str) -> None:
        """Refuse bytes that are no request."""
        refusal = InvalidRequest(key="request", reason="it is not HTTP as the standard has it")
        super().send_400_response(bytes(problem(refusal, status=400).body).decode("ascii"))


class _ToLog(logging.Handler):
    """Hands what the server complains of to our log; without a handler it would go to the screen."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write a defect down; a request that was cut short at the end is none."""
        defect = record.exc_info[1] if record.exc_info else None
        if isinstance(defect, Exception):
            written_down(defect)


def _keep_quiet() -> None:
    log = logging.getLogger("uvicorn.error")
    log.propagate = False
    if not log.handlers:
        log.addHandler(_ToLog())


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
    _keep_quiet()
    config = uvicorn.Config(
        app,
        http=_Protocol,
        ws=Wire,
        log_config=None,
        access_log=False,
        lifespan="off",
        timeout_graceful_shutdown=1,
        loop="asyncio",
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
