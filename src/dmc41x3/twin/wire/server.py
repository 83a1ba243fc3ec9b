"""The virtual controller with its connections: TCP, UDP, a serial port or memory.

Its clock is that of the running event loop. The machine is advanced to the present whenever data arrive or its state is
read; a timer runs only while a program runs, or records are sent by themselves.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Coroutine
from ipaddress import IPv4Address
from math import inf, nextafter

from dmc41x3.errors import AddressInUse
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.memory import Memory
from dmc41x3.twin.network import RETRIES, Handle, HandleProtocol, quad
from dmc41x3.twin.plant import ServoBench
from dmc41x3.twin.wire.connections import (
    ListeningPort,
    LoopbackLink,
    LoopbackPort,
    SerialLink,
    WireLink,
    ask_for_address,
    dial,
    listen,
)
from dmc41x3.twin.wire.faults import Disturbance
from dmc41x3.twin.wire.injection import Faults
from dmc41x3.wire.bootp import parse_mac
from dmc41x3.wire.transport import LoopbackDatagrams, LoopbackTransport, datagram_pair, loopback_pair

_LINES = re.compile(rb"[^\r]*\r|[^\r]+")
"""The lines of received bytes, the last one perhaps unfinished."""

TICK = 1.0 / 256.0
"""Period of sending a program's messages [s]; the timing of its statements is still exact to the sample."""

Tap = Callable[[str, str, bytes], None]
"""Wire log: handle letter, "rx" or "tx" as the controller sees it, bytes."""


class VirtualController:
    """Owns a machine and its connections. Created in a running loop, whose clock then drives that of the machine.

    `tap`, if set, receives all bytes; `faults` are the faults on demand, with random numbers from `seed`. Call `close`
    at the end.
    """

    def __init__(self, machine: VirtualDmc, *, seed: int = 0) -> None:
        self._machine = machine
        self._loop = asyncio.get_running_loop()
        self._epoch = self._loop.time() - machine.now
        self._links: dict[Handle, WireLink] = {}
        self._orphans: dict[Handle, WireLink] = {}
        self._due: dict[WireLink, float] = {}
        self._listeners: list[ListeningPort] = []
        self._host = ""
        self._address = machine.unit.network.address
        self._moving: asyncio.Task[None] | None = None
        self._asking: asyncio.Task[None] | None = None
        self._ports: list[LoopbackPort] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._dials: dict[Handle, asyncio.Task[None]] = {}
        self._timer: asyncio.TimerHandle | None = None
        self._off = False
        self.tap: Tap | None = None
        self.wire = Disturbance(seed)
        self.faults = Faults(self)
        machine.balk = self.wire.balks

    @property
    def machine(self) -> VirtualDmc:
        """The machine, advanced to the present time."""
        self.sync()
        return self._machine

    @property
    def connections(self) -> str:
        """Letters of the handles in use."""
        return "".join(sorted(handle.letter for handle in self._links))

    def sync(self) -> None:
        """Advance machine and plant to the present time."""
        self._machine.advance(self._loop.time() - self._epoch)

    def time(self) -> float:
        """Return the loop's time [s]."""
        return self._loop.time()

    def later(self, seconds: float, act: Callable[[], None]) -> asyncio.TimerHandle:
        """Call `act` after `seconds` [s] of the loop's time."""
        return self._loop.call_later(seconds, act)

    def look(self) -> None:
        """Advance the machine to the present time and send its unsolicited output."""
        self.sync()
        self._after()

    async def serve(self, host: str = "127.0.0.1", port: int = 0, *, udp: bool = True) -> tuple[str, int]:
        """Listen on TCP, and on the UDP port of the same number, and return the address; port 0 chooses a free one.

        May be called again for further ports of the same machine. Raises `AddressInUse`.
        """
        listener = await listen(self, host, port, udp=udp)
        self._listeners.append(listener)
        self._host = listener.address[0]
        return listener.address

    def ask_for_address(self, server: tuple[str, int]) -> None:
        """Forget the address, and ask a BOOTP or DHCP server (see DH) for one until it answers."""
        self._machine.unit.network.address = self._address = (0, 0, 0, 0)
        self._asking = self._loop.create_task(self._ask_for_address(server))
        self._keep(self._asking)

    async def _ask_for_address(self, server: tuple[str, int]) -> None:
        unit = self._machine.unit
        mac = parse_mac(unit.identity.hardware_address)
        found = await ask_for_address(server, mac, dhcp=unit.network.dhcp)
        unit.network.address, unit.network.mask = quad(found.address), quad(found.mask)
        self._after()

    async def _move(self, host: str) -> None:
        """Listen on another address of this computer; all connections to the old one end."""
        for place, listener in enumerate(self._listeners):
            if listener.address[0] == host:
                continue
            try:
                moved = await listen(self, host, listener.address[1], udp=listener.udp is not None)
            except AddressInUse as error:
                self._machine.unit.note(f"the twin still listens at {listener.address[0]}: {error}")
                continue
            self._listeners[place] = moved
            listener.close()
            for handle in [handle for handle, link in self._links.items() if link is not self._serial_link]:
                self._links[handle].close()
                self._release(handle)

    @property
    def address(self) -> tuple[str, int]:
        """The first address at which the controller listens."""
        return self._listeners[0].address

    @property
    def _serial_link(self) -> WireLink | None:
        serial = self._machine.unit.handles.serial
        return None if serial is None else self._links.get(serial)

    def serve_serial(self) -> str:
        """Connect the main serial port to a pseudo terminal and return its path; it is an address of the machine."""
        link = SerialLink(self)
        handle = self._machine.plug()
        self._links[handle] = link
        link.run(handle)
        return link.path

    def unplug(self) -> None:
        """Pull the cable out of the main serial port."""
        handle = self._machine.unit.handles.serial
        if handle is not None:
            link = self._links[handle]
            self._release(handle)
            link.cut()

    def loopback(self) -> LoopbackTransport:
        """Return the host's end of a new connection in memory; a refused connection ends at once."""
        host, controller = loopback_pair("virtual controller")
        link = LoopbackLink(self, controller)
        handle = self.accept(link, ("127.0.0.1", 0), HandleProtocol.TCP, 23)
        if handle is None:
            controller.cut()
            return host
        self.spawn(link.run(handle))
        return host

    def loopback_datagrams(self) -> LoopbackDatagrams:
        """Return the host's end of a datagram connection in memory, in place of UDP."""
        host, controller = datagram_pair("virtual controller")
        port = LoopbackPort(self, controller)
        self._ports.append(port)
        self.spawn(port.run())
        return host

    def spawn(self, work: Coroutine[None, None, None]) -> None:
        """Run `work` in the background; `close` waits for it."""
        self._keep(self._loop.create_task(work))

    def _keep(self, task: asyncio.Task[None]) -> None:
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def cut(self, letters: str = "ABCDEFGH") -> None:
        """Cut connections abruptly, as a pulled cable does; the axes are not affected."""
        self.sync()
        for handle, link in list(self._links.items()):
            if handle.letter in letters:
                self._release(handle)
                self.wire.silent.discard(handle)
                link.cut()

    def refuse(self, refusing: bool) -> None:
        """Refuse new connections from now on, or accept them again."""
        self.wire.refusing = refusing

    def silence(self, letters: str) -> None:
        """Make connections silent: neither side receives data or learns of the other's end."""
        self.wire.silent |= {handle for handle in self._links if handle.letter in letters}

    def unsilence(self, letters: str = "ABCDEFGH") -> None:
        """Make silent connections work again; those that one side abandoned meanwhile end."""
        for handle in [handle for handle in self.wire.silent if handle.letter in letters]:
            self.wire.silent.discard(handle)
            link = self._orphans.pop(handle, None)
            if link is not None:
                self._release(handle)
                link.cut()

    def abort_input(self, active: bool) -> None:
        """Press or release the emergency stop."""
        self.machine.abort_input(active)

    def amplifier_fault(self, status: int) -> None:
        """Set the amplifiers' fault bits; 0 means no fault."""
        self.machine.amplifier_fault(status)

    def reset(self) -> None:
        """Reset the controller as a dip of its supply does: like RS, and every connection ends without notice."""
        if not self._off:
            self.power(False)
            self.power(True)

    def power(self, on: bool) -> None:
        """Switch the controller's supply; while it is off, connections are refused."""
        self.cut()
        self._off = not on
        if on:
            self._machine.power_on()
        else:
            self._machine.power_off()
        self._after()

    async def close(self) -> None:
        """Stop listening and end every connection."""
        self.faults.close()
        if self._timer is not None:
            self._timer.cancel()
        for task in (self._asking, self._moving):
            if task is not None:
                task.cancel()
                await asyncio.wait({task})
        listeners, self._listeners = self._listeners, []
        for listener in listeners:
            listener.close()
        for task in self._dials.values():
            task.cancel()
        for handle, link in list(self._links.items()):
            self._release(handle)
            link.close()
        for orphan in self._orphans.values():
            orphan.cut()
        for port in self._ports:
            port.close()
        if self._tasks:
            await asyncio.wait(self._tasks)
        for listener in listeners:
            await listener.server.wait_closed()

    def accept(self, link: WireLink, peer: tuple[str, int], kind: HandleProtocol, port: int) -> Handle | None:
        """Return a handle for a new connection, None if no handle is free or connections are refused."""
        handle = None if self.wire.refusing or self._off else self._machine.connect(peer, kind, port)
        if handle is not None:
            self._links[handle] = link
        return handle

    def ended(self, handle: Handle, broken: bool) -> None:
        """Free the handle of an ended connection; a silent handle does not notice the end."""
        link = self._links.get(handle)
        if link is not None and handle in self.wire.silent:
            self._orphans[handle] = link
            return
        self._release(handle)
        if broken and link is not None:
            self._tcp_error(handle)

    def received(self, handle: Handle, data: bytes) -> None:
        """Pass bytes of a connection to the machine and send its answers and messages."""
        if (self.wire.silent and handle in self.wire.silent) or self._off:
            return
        if self.tap is not None:
            self.tap(handle.letter, "rx", data)
        # A serial port has one stream: messages stand between the replies where they were made.
        for piece in _LINES.findall(data) if handle.kind is HandleProtocol.SERIAL else (data,):
            reply = self._machine.receive(handle, piece, self._loop.time() - self._epoch)
            if reply:
                self._send(handle, reply)
            self._send_messages()
        self._after()

    def reached(self, handle: Handle, link: WireLink) -> None:
        """Store the link of a connection that IH opened."""
        self._links[handle] = link

    def gave_up(self, handle: Handle) -> None:
        """Close a handle that IH could not connect."""
        if handle.open:
            self._release(handle)
            self._tcp_error(handle)

    def _release(self, handle: Handle) -> None:
        link = self._links.pop(handle, None)
        if link is not None:
            self._due.pop(link, None)
        self._machine.disconnect(handle)

    def _tcp_error(self, handle: Handle) -> None:
        self.machine.unit.tcp_error(handle.index)
        self._machine.look()
        self._after()

    def _send_messages(self) -> None:
        for handle, message in self._machine.take_messages():
            self._send(handle, message)

    def _after(self) -> None:
        """Send unsolicited output, open and end connections, and set the timer for the next output."""
        self._send_messages()
        for handle in self._machine.unit.handles.take_dialing():
            self._dial(handle)
        self._close_released()
        self._follow_address()
        wake = self._machine.wake() + self._epoch
        if wake == inf:
            return  # an earlier timer may still fire, without anything to do
        wake = max(wake, self._loop.time() + TICK)
        if self._timer is not None and self._timer.when() > wake:
            self._timer.cancel()
            self._timer = None
        if self._timer is None:
            self._timer = self._loop.call_at(wake, self._tick)

    def _follow_address(self) -> None:
        """Listen at the controller's address (IA) if it is one of the loopback; at any other, at the first one."""
        address = self._machine.unit.network.address
        if address == self._address or not self._listeners:
            return
        self._address = address
        host = str(IPv4Address(bytes(address)))
        before, self._moving = self._moving, None
        if before is not None:
            before.cancel()
        self._moving = self._loop.create_task(self._move(host if IPv4Address(host).is_loopback else self._host))
        self._keep(self._moving)

    def _tick(self) -> None:
        self._timer = None
        self.look()

    @property
    def _retry_time(self) -> float:
        """Time between two attempts on a silent TCP handle (IA) [s]."""
        unit = self._machine.unit
        return unit.network.retry * unit.period

    def _dial(self, handle: Handle) -> None:
        task = self._loop.create_task(dial(self, handle, self._retry_time))
        self._dials[handle] = task
        task.add_done_callback(lambda _: self._dials.pop(handle, None))
        self._keep(task)

    def _send(self, handle: Handle, data: bytes) -> None:
        link = self._links.get(handle)
        if link is None:
            return
        if self.tap is not None:
            self.tap(handle.letter, "tx", data)
        if self.wire.clear and not self._due:
            link.send(data)
        else:
            self._send_disturbed(handle, link, data)

    def _send_disturbed(self, handle: Handle, link: WireLink, data: bytes) -> None:
        """Send with the disturbances of the wire, in order."""
        if handle in self.wire.silent:
            if handle.kind is HandleProtocol.TCP:
                self._loop.call_later(RETRIES * self._retry_time, self._unheard, handle)
            return
        now = self._loop.time()
        for piece in self.wire.outgoing(data):
            last = self._due.get(link)
            due = now + self.wire.delay() if last is None else max(now + self.wire.delay(), nextafter(last, inf))
            if due <= now:
                link.send(piece)
                continue
            self._due[link] = due
            self._loop.call_at(due, self._arrive, link, piece, due)

    def _arrive(self, link: WireLink, data: bytes, due: float) -> None:
        if self._due.get(link) == due:
            del self._due[link]
        link.send(data)

    def _unheard(self, handle: Handle) -> None:
        """Close a TCP handle whose packets were not acknowledged; the other side still receives nothing."""
        link = self._links.get(handle)
        if link is None or handle not in self.wire.silent:
            return
        self._orphans[handle] = link
        self._release(handle)
        self._tcp_error(handle)

    def _close_released(self) -> None:
        """End the connections whose handles a command has closed (IH, RS), also those still being opened."""
        for handle in [handle for handle in self._links if not handle.open]:
            link = self._links[handle]
            self._release(handle)
            link.close()
        for handle, task in self._dials.items():
            if not handle.open:
                task.cancel()


def bench(axes: int, memory: Memory | None = None, firmware: str | None = None, seed: int = 0) -> VirtualController:
    """Return a controller of `axes` servo motors on a bench, in the running loop; `seed` is that of its faults."""
    return VirtualController(VirtualDmc(ServoBench(axes), axes=axes, memory=memory, firmware=firmware), seed=seed)
