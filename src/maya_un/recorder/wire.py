"""Transports that write down what passes through them, and otherwise are the ones they wrap."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from dmc41x3.wire.transcript import Side
from dmc41x3.wire.transport import Datagrams, Transport
from maya_un.errors import MachineError
from maya_un.recorder.ring import WireDirection


class PieceSink(Protocol):
    """Takes a piece of the wire."""

    def __call__(self, way: WireDirection, data: bytes = b"") -> None:
        """Keep what passes now; without data, that the connection begins or ends."""
        ...


class RecordedTransport:
    """A transport whose bytes, begin and end go to `note` as connection number `link`."""

    __slots__ = ("_ended", "_inner", "_link", "_note", "_received", "_sent")

    def __init__(self, inner: Transport, note: PieceSink, link: int) -> None:
        self._inner = inner
        self._note = note
        self._link = link
        self._sent, self._received = WireDirection(link, "client"), WireDirection(link, "controller")
        self._ended = False
        note(WireDirection(link, "client", "open"))

    @property
    def peer(self) -> str:
        """Whom this leads to, as shown to people."""
        return self._inner.peer

    async def read(self) -> bytes:
        """Return what has come, or `b""` at the end; raises as the transport itself."""
        try:
            data = await self._inner.read()
        except MachineError:
            self._end("controller")
            raise
        if data:
            self._note(self._received, data)
        else:
            self._end("controller")
        return data

    def write(self, data: bytes) -> None:
        """Hand over bytes at once; raises as the transport itself."""
        self._note(self._sent, data)
        self._inner.write(data)

    async def close(self) -> None:
        """End the connection; again is harmless."""
        self._end("client")
        await self._inner.close()

    def _end(self, side: Side) -> None:
        if not self._ended:
            self._ended = True
            self._note(WireDirection(self._link, side, "end"))


class RecordedDatagrams:
    """A way for datagrams, such as data records that come by themselves (DR), whose traffic goes to `note`.

    Its number `link` is negative: what comes there answers nothing.
    """

    __slots__ = ("_ended", "_inner", "_link", "_note", "_received", "_sent")

    def __init__(self, inner: Datagrams, note: PieceSink, link: int) -> None:
        self._inner = inner
        self._note = note
        self._link = link
        self._sent, self._received = WireDirection(link, "client"), WireDirection(link, "controller")
        self._ended = False
        note(WireDirection(link, "client", "open"))

    @property
    def peer(self) -> str:
        """Whom this leads to, as shown to people."""
        return self._inner.peer

    async def read(self) -> bytes:
        """Return the next datagram, or `b""` at the end; raises as the way itself."""
        data = await self._inner.read()
        if data:
            self._note(self._received, data)
        return data

    def deliver(self, taker: Callable[[bytes], None]) -> None:
        """Hand datagrams to `taker` as they come, from now on; `read` then only tells the end."""
        note, received = self._note, self._received

        def take(data: bytes) -> None:
            note(received, data)
            taker(data)

        self._inner.deliver(take)

    def write(self, data: bytes) -> None:
        """Send one datagram."""
        self._note(self._sent, data)
        self._inner.write(data)

    async def close(self) -> None:
        """Give back what it held; again is harmless."""
        if not self._ended:
            self._ended = True
            self._note(WireDirection(self._link, "client", "end"))
        await self._inner.close()
