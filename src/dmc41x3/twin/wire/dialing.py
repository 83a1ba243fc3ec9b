"""Connections that the controller opens itself (IH): dialled in the running loop, given up after the retries of IA."""

from __future__ import annotations

import asyncio
from typing import Protocol

from dmc41x3.twin.handles import Attempt, Handle, HandleProtocol
from dmc41x3.twin.network import RETRIES
from dmc41x3.twin.wire.link import LinkOwner, TcpLink, WireLink
from dmc41x3.twin.wire.udp import UdpDial


class DialOwner(LinkOwner, Protocol):
    """Who dials: it owns the link once the other side has answered."""

    def reached(self, handle: Handle, link: WireLink) -> None:
        """Take the link of a handle that is connected now."""
        ...

    def gave_up(self, handle: Handle) -> None:
        """Close a handle that nobody answers on."""
        ...


async def dial(caller: DialOwner, handle: Handle, pause: float) -> None:
    """Connect a handle; with TCP try again up to five times, `pause` [s] apart."""
    for attempt in range(RETRIES + 1):
        if attempt:
            await asyncio.sleep(pause)
        try:
            async with asyncio.timeout(max(pause, 0.01) * RETRIES):
                link = await _connected(caller, handle)
        except (OSError, TimeoutError):
            continue
        if not handle.open:
            link.cut()
            return
        handle.connected = True
        caller.reached(handle, link)
        return
    handle.attempt = Attempt.FAILED
    caller.gave_up(handle)


async def _connected(caller: DialOwner, handle: Handle) -> WireLink:
    loop = asyncio.get_running_loop()
    if handle.kind is HandleProtocol.TCP:
        transport, link = await loop.create_connection(lambda: TcpLink(caller, handle), *handle.peer)
    else:
        transport, link = await loop.create_datagram_endpoint(lambda: UdpDial(caller, handle), remote_addr=handle.peer)
    handle.port = transport.get_extra_info("sockname")[1]
    return link
