"""One connection of the server: how many there may be, how long a request may take to be said, and what is no HTTP."""

from __future__ import annotations

import asyncio
from collections import Counter
from http import HTTPStatus
from typing import Any

import h11
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from dmc41x3.listening import ALL, DescriptorShare, Refusals
from maya_un import __version__
from maya_un.errors import InvalidRequest
from maya_un.server.framing import StrictConnection
from maya_un.server.problems import problem

HEAD_PATIENCE = 10.0
"""How long the head of a request may take to arrive [s, real time]."""

LONGEST_HEAD = 65_536
"""Longest head of a request [bytes]."""

STOP_PATIENCE = 2.0
"""How long the head of a request may take on such a connection [s, real time]."""

STOPS_ONLY = "stops only"
"""In the state of a request that came without a place: it is answered where it says stop or abort."""


class ConnectionSlots:
    """The free connections of a listener: `most` in all, `most_each` of one address, within a `share` of descriptors.

    `without` has connections beyond these numbers, admitted for a stop, oldest first; if the share is used up, a new
    one ends the oldest.
    """

    def __init__(self, most: int, most_each: int, share: DescriptorShare = ALL) -> None:
        self._most = most
        self._most_each = most_each
        self._taken: Counter[str] = Counter()
        self.share = share
        self.refusals: Refusals | None = None
        self.without: dict[BoundedProtocol, None] = {}

    def take(self, address: str, descriptor: int = 0) -> bool:
        """Take a place; return whether a place and a descriptor were free."""
        if self._taken.total() >= self._most or self._taken[address] >= self._most_each:
            return False
        if descriptor >= self.share.full:
            return False
        self._taken[address] += 1
        return True

    def end_oldest(self) -> None:
        """End the oldest connection without a place."""
        oldest = next(iter(self.without))
        del self.without[oldest]
        oldest.transport.abort()
        if self.refusals is not None:
            self.refusals.add()

    def give_back(self, address: str) -> None:
        """Give a place back."""
        self._taken[address] -= 1
        if not self._taken[address]:
            del self._taken[address]


class BoundedProtocol(H11Protocol):
    """Takes a place while it lasts, and is cut where a request does not come to its point."""

    def __init__(
        self,
        places: ConnectionSlots,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self.conn = StrictConnection(h11.SERVER, LONGEST_HEAD)
        self._places = places
        self._place: str | None = None
        self._late: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a place; where none is left, stay for a stop."""
        super().connection_made(transport)
        address = self.client[0] if self.client else ""
        connection = transport.get_extra_info("socket")
        if self._places.take(address, 0 if connection is None else connection.fileno()):
            self._place = address
            self._await_head(HEAD_PATIENCE)
            return
        others = self._places.without
        others[self] = None
        if len(others) > self._places.share.stops:
            self._places.end_oldest()
        self.app_state = {**self.app_state, STOPS_ONLY: True}
        self._await_head(STOP_PATIENCE)

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place back."""
        self._leave()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read on; a request that has begun must come to its point soon."""
        if self._late is None and self.conn.their_state is h11.IDLE:
            self._await_head(HEAD_PATIENCE if self._place is not None else STOP_PATIENCE)
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._head_came()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Give the place back: how many read the stream is bounded there."""
        self._leave()
        super().handle_websocket_upgrade(event)

    def send_400_response(self, msg: str) -> None:
        """Refuse bytes that are no request, with our code, too."""
        refusal = InvalidRequest(key="request", reason="it is not HTTP as the standard has it")
        body = bytes(problem(refusal, status=HTTPStatus.BAD_REQUEST).body)
        headers = [
            (b"content-type", b"application/problem+json"),
            (b"content-length", str(len(body)).encode()),
            (b"maya", __version__.encode()),
            (b"connection", b"close"),
        ]
        for part in (
            h11.Response(status_code=HTTPStatus.BAD_REQUEST, headers=headers, reason=b"Bad Request"),
            h11.Data(data=body),
            h11.EndOfMessage(),
        ):
            self.transport.write(self.conn.send(part) or b"")
        self.transport.close()

    def _await_head(self, patience: float) -> None:
        self._late = self.loop.call_later(patience, self.transport.abort)

    def _head_came(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None

    def _leave(self) -> None:
        self._head_came()
        self._places.without.pop(self, None)
        if self._place is not None:
            self._places.give_back(self._place)
            self._place = None
