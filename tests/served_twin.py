"""A virtual controller on TCP and UDP for clients that block: it runs in a thread of its own, in real time."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import TypeVar

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.framing import LineSplitter, RecordReply, Reply, ReplyKind, ReplySplitter

T = TypeVar("T")

_KINDS = {"QR": ReplyKind.RECORD, "UL": ReplyKind.LISTING, "QU": ReplyKind.LISTING}


class Conversation:
    """Commands and answers on one handle, up to the first download (DL, QD), which this does not follow."""

    def __init__(self) -> None:
        self._lines = LineSplitter()
        self._replies = ReplySplitter()
        self._open: list[str] = []
        self.pairs: list[tuple[str, str]] = []

    def see(self, way: str, data: bytes) -> None:
        """Take note of bytes as the controller sees them."""
        if way == "rx":
            for command in self._lines.feed(data):
                self._open.append(command)
                self._replies.expect(_KINDS.get(command[:2], ReplyKind.TEXT))
            return
        for received in self._replies.feed(data):
            if isinstance(received, Reply):
                self.pairs.append((self._open.pop(0), received.text if received.ok else "?"))
            elif isinstance(received, RecordReply):
                self.pairs.append((self._open.pop(0), "a record"))


class ServedTwin:
    """The controller in the other thread: its address, its conversations, and its state."""

    def __init__(self, loop: asyncio.AbstractEventLoop, controller: VirtualController, host: str, port: int) -> None:
        self._loop = loop
        self._controller = controller
        self.host = host
        self.port = port
        self.conversations: dict[str, Conversation] = {}
        controller.tap = self._see

    @property
    def address(self) -> str:
        """Host and port."""
        return f"{self.host}:{self.port}"

    def look(self, at: Callable[[VirtualDmc], T]) -> T:
        """Return what `at` finds in the machine of this instant."""
        return self.do(lambda controller: at(controller.machine))

    def do(self, work: Callable[[VirtualController], T]) -> T:
        """Do something to the controller, in its thread, and return what that returns."""
        done: Future[T] = Future()

        def run() -> None:
            try:
                done.set_result(work(self._controller))
            except BaseException as error:  # noqa: BLE001 - whoever asked gets it
                done.set_exception(error)

        self._loop.call_soon_threadsafe(run)
        return done.result(10.0)

    @property
    def said(self) -> list[tuple[str, str]]:
        """Commands and answers of all handles; those of one are in order."""
        return [pair for conversation in self.conversations.values() for pair in conversation.pairs]

    @property
    def refused(self) -> list[str]:
        """Commands that were answered `?`, once each."""
        return list(dict.fromkeys(command for command, reply in self.said if reply == "?"))

    def _see(self, letter: str, way: str, data: bytes) -> None:
        self.conversations.setdefault(letter, Conversation()).see(way, data)


@contextmanager
def served(axes: int = 3, *, udp: bool = True) -> Iterator[ServedTwin]:
    """Serve a controller with ideal axes while the block runs."""
    started: Future[ServedTwin] = Future()
    over = asyncio.Event()

    async def serve() -> None:
        controller = VirtualController(VirtualDmc(BenchPlant(axes), axes=axes))
        try:
            host, port = await controller.serve(udp=udp)
            started.set_result(ServedTwin(asyncio.get_running_loop(), controller, host, port))
            await over.wait()
        except BaseException as error:
            if not started.done():
                started.set_exception(error)
            raise
        finally:
            await controller.close()

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    twin = started.result(10.0)
    try:
        yield twin
    finally:
        twin.do(lambda _: over.set())
        thread.join(10.0)
