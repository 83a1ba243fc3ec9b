"""Where a virtual controller listens: a TCP port, and the UDP port of the same number."""

from __future__ import annotations

import asyncio
from typing import NamedTuple

from dmc41x3 import listening
from dmc41x3.errors import AddressInUse
from dmc41x3.twin.wire.link import LinkOwner, TcpLink
from dmc41x3.twin.wire.udp import UdpPort

_ATTEMPTS = 20
"""How many ports are tried for one that is free for TCP and UDP both."""


class ListeningPort(NamedTuple):
    """One port that is listened on; `udp` is None where it is TCP alone."""

    address: tuple[str, int]
    server: asyncio.AbstractServer
    udp: UdpPort | None

    def close(self) -> None:
        """Stop listening."""
        self.server.close()
        if self.udp is not None:
            self.udp.close()


async def listen(owner: LinkOwner, host: str, port: int, *, udp: bool) -> ListeningPort:
    """Listen for `owner`; port 0 chooses a free one. Raises `AddressInUse`."""
    for left in reversed(range(1 if port else _ATTEMPTS)):
        try:
            return await _open(owner, host, port, udp)
        except OSError as error:
            if not left:
                raise AddressInUse(address=f"{host}:{port}") from error
    raise AssertionError


async def _open(owner: LinkOwner, host: str, port: int, udp: bool) -> ListeningPort:
    loop = asyncio.get_running_loop()
    server = await listening.listen(host, port, lambda: TcpLink(owner))
    address = server.address
    if not udp:
        return ListeningPort(address, server, None)
    try:
        _, datagrams = await loop.create_datagram_endpoint(lambda: UdpPort(owner), local_addr=address)
    except OSError:
        server.close()
        await server.wait_closed()
        raise
    return ListeningPort(address, server, datagrams)
