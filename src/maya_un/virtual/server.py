"""The virtual controller on a wire: TCP or memory, in the running event loop, on that loop's clock.

The machine is brought to the loop's time whenever somebody talks to it or looks at it; a timer runs only while a
program does, or records go out by themselves.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Coroutine
from math import inf
from typing import Protocol, cast

from maya_un.errors import AddressInUse
from maya_un.galil.transport import LoopbackTransport, loopback_pair
from maya_un.virtual.handles import Handle
from maya_un.virtual.machine import VirtualDmc

TICK = 1.0 / 256.0
"""Where a program runs, its messages are sent this often [s]; what it does is timed to the sample all the same."""

Tap = Callable[[str, str, bytes], None]
"""Wire log: handle letter, "rx" or "tx" as the controller sees it, bytes."""


class _Link(Protocol):
    """One connection: bytes out, an end in order, an end by force."""

    def send(self, data: bytes) -> None: ...

    def close(self) -> None: ...

    def cut(self) -> None: ...


class VirtualController:
    """Owns a machine and its connections. Made inside a running loop, whose clock becomes the machine's.

    `tap`, if set, sees all bytes. Use `close` at the end.
    """

    def __init__(self, machine: VirtualDmc) -> None:
        self._machine = machine
        self._loop = asyncio.get_running_loop()
        self._links: dict[Handle, _Link] = {}
        self._server: asyncio.Server | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._refusing = False
        self._timer: asyncio.TimerHandle | None = None
        self.tap: Tap | None = None

    @property
    def machine(self) -> VirtualDmc:
        """The machine, brought to this instant."""
        self.sync()
        return self._machine

    @property
    def connections(self) -> str:
        """Letters of the handles in use."""
        return "".join(sorted(handle.letter for handle in self._links))

    def sync(self) -> None:
        """Bring machine and plant to the loop's time."""
        self._machine.advance(self._loop.time())

    async def serve(self, host: str = "127.0.0.1", port: int = 0) -> tuple[str, int]:
        """Listen on TCP and return the address; port 0 chooses a free one. Raises `AddressInUse`."""
        try:
            self._server = await self._loop.create_server(lambda: _TcpLink(self), host, port)
        except OSError as error:
            raise AddressInUse(address=f"{host}:{port}") from error
        name = self._server.sockets[0].getsockname()
        return name[0], name[1]

    def loopback(self) -> LoopbackTransport:
        """Return the host's end of a new connection in memory; one that is refused is at its end at once."""
        host, controller = loopback_pair("virtual controller")
        link = _LoopbackLink(self, controller)
        handle = self.accept(link, ("127.0.0.1", 0))
        if handle is None:
            controller.cut()
            return host
        self.spawn(link.run(handle))
        return host

    def spawn(self, work: Coroutine[None, None, None]) -> None:
        """Run `work` beside the rest; `close` waits for it."""
        task = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def cut(self) -> None:
        """Sever every connection abruptly, as a pulled cable does; the axes know nothing of it."""
        self.sync()
        for handle, link in list(self._links.items()):
            self.release(handle)
            link.cut()

    def refuse(self, refusing: bool) -> None:
        """Refuse new connections from now on, or take them again."""
        self._refusing = refusing

    def abort_input(self, active: bool) -> None:
        """Press or release the emergency stop."""
        self.machine.abort_input(active)

    def amplifier_fault(self, status: int) -> None:
        """Set the amplifiers' fault bits; 0 is well."""
        self.machine.amplifier_fault(status)

    async def close(self) -> None:
        """Stop listening and end every connection."""
        if self._timer is not None:
            self._timer.cancel()
        server, self._server = self._server, None
        if server is not None:
            server.close()
        for handle, link in list(self._links.items()):
            self.release(handle)
            link.close()
        if self._tasks:
            await asyncio.wait(self._tasks)
        if server is not None:
            await server.wait_closed()

    def accept(self, link: _Link, peer: tuple[str, int]) -> Handle | None:
        """Give a new connection a handle, None where none is free or connections are refused."""
        handle = None if self._refusing else self._machine.connect(peer)
        if handle is not None:
            self._links[handle] = link
        return handle

    def release(self, handle: Handle) -> None:
        """Give a handle back whose connection has ended."""
        self._links.pop(handle, None)
        self._machine.disconnect(handle)

    def received(self, handle: Handle, data: bytes) -> None:
        """Hand bytes of a connection to the machine and send what it answers, to whom it concerns."""
        if self.tap is not None:
            self.tap(handle.letter, "rx", data)
        reply = self._machine.receive(handle, data, self._loop.time())
        if reply:
            self._send(handle, reply)
        self._after()

    def _after(self) -> None:
        """Send what nobody asked for, end what was closed, and see to being woken when there will be more."""
        for handle, message in self._machine.take_messages():
            self._send(handle, message)
        self._close_released()
        wake = max(self._machine.wake(), self._loop.time() + TICK)
        if self._timer is not None and self._timer.when() > wake:
            self._timer.cancel()
            self._timer = None
        if self._timer is None and wake < inf:
            self._timer = self._loop.call_at(wake, self._tick)

    def _tick(self) -> None:
        self._timer = None
        self.sync()
        self._after()

    def _send(self, handle: Handle, data: bytes) -> None:
        link = self._links.get(handle)
        if link is None:
            return
        if self.tap is not None:
            self.tap(handle.letter, "tx", data)
        link.send(data)

    def _close_released(self) -> None:
        """End the connections whose handles a command (IH) has closed."""
        for handle, link in list(self._links.items()):
            if not handle.open:
                self.release(handle)
                link.close()


class _TcpLink(asyncio.Protocol):
    """A TCP connection."""

    def __init__(self, owner: VirtualController) -> None:
        self._owner = owner
        self._transport: asyncio.Transport | None = None
        self._handle: Handle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        peer = transport.get_extra_info("peername")
        self._handle = self._owner.accept(self, (str(peer[0]), int(peer[1])))
        if self._handle is None:
            self._transport.abort()
            return
        sock: socket.socket = transport.get_extra_info("socket")
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def data_received(self, data: bytes) -> None:
        if self._handle is not None and self._handle.open:
            self._owner.received(self._handle, data)

    def connection_lost(self, exc: Exception | None) -> None:
        if self._handle is not None:
            self._owner.release(self._handle)

    def send(self, data: bytes) -> None:
        if self._transport is not None:
            self._transport.write(data)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()

    def cut(self) -> None:
        if self._transport is not None:
            self._transport.abort()


class _LoopbackLink:
    """A connection in memory: the controller's end."""

    def __init__(self, owner: VirtualController, end: LoopbackTransport) -> None:
        self._owner = owner
        self._end = end
        self._open = True

    async def run(self, handle: Handle) -> None:
        """Read until the other side ends."""
        while data := await self._end.read():
            if handle.open:
                self._owner.received(handle, data)
        self._open = False
        self._owner.release(handle)
        await self._end.close()

    def send(self, data: bytes) -> None:
        if self._open:
            self._end.write(data)

    def close(self) -> None:
        self._open = False
        self._owner.spawn(self._end.close())

    def cut(self) -> None:
        self._open = False
        self._end.cut()
