"""HTTP connections: their limits, and the refusal of requests with an ambiguous end (RFC 9112).

If a proxy in front of the service finds another end, data of one client become part of another client's request. h11
refuses most such requests; this module refuses those that h11 repairs or leaves to the server.
"""

from __future__ import annotations

import asyncio
import socket
from asyncio.trsock import TransportSocket
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
from maya_un.http.errors import problem

_LENGTH, _CODING = b"content-length", b"transfer-encoding"
_ONCE = (_LENGTH, _CODING, b"authorization", b"maya-lease", b"upgrade")
_VERSIONS = frozenset({b"1.0", b"1.1"})


class StrictConnection(h11.Connection):
    """Server side of an HTTP/1 connection; `next_event` also raises `RemoteProtocolError` for a doubtful head."""

    def __init__(self, our_role: type[h11.CLIENT] | type[h11.SERVER], longest_head: int) -> None:
        super().__init__(our_role, longest_head)
        self._head: bytearray | None = bytearray()

    def receive_data(self, data: bytes) -> None:
        """Receive bytes of the client."""
        if self._head is not None:
            self._head += data
        super().receive_data(data)

    def next_event(self) -> h11.Event | type[h11.NEED_DATA] | type[h11.PAUSED]:
        """Return the next event."""
        event = super().next_event()
        if isinstance(event, h11.Request) and self._head is not None:
            head, self._head = self._head[: len(self._head) - len(self.trailing_data[0])], None
            why = doubtful(bytes(head), event.http_version)
            if why:
                raise h11.RemoteProtocolError(why)
        return event

    def start_next_cycle(self) -> None:
        """Start with the next request."""
        super().start_next_cycle()
        self._head = bytearray(self.trailing_data[0])


def doubtful(head: bytes, version: bytes) -> str:
    """Return the reason to refuse the head of a request of this HTTP version, "" for none."""
    lines = head.removesuffix(b"\r\n\r\n").split(b"\r\n")
    fields = [(name.lower(), value.strip()) for name, _, value in (line.partition(b":") for line in lines[1:])]
    often, values = Counter(name for name, _ in fields), dict(fields)
    length, coded = values.get(_LENGTH), _CODING in values
    reasons = {
        "a line ends without a carriage return": any(b"\n" in line for line in lines),
        "a header continues in the next line": any(line[:1] in (b" ", b"\t") for line in lines),
        "a header that may occur once occurs twice": any(often[name] > 1 for name in _ONCE),
        "the length of the body is not a number": length is not None and not length.isdigit(),
        "the body has a length and a transfer coding": length is not None and coded,
        "this version of HTTP does not exist": version not in _VERSIONS,
        "HTTP/1.0 has no transfer codings": coded and version == b"1.0",
        "a request for another protocol has a body": b"upgrade" in values
        and (coded or bool((length or b"").strip(b"0"))),
    }
    return next((why for why, so in reasons.items() if so), "")


HEAD_PATIENCE = 10.0
"""Time limit for the head of a request [s, real time]."""

LONGEST_HEAD = 65_536
"""Longest head of a request [bytes]."""

STOP_PATIENCE = 2.0
"""Time limit for the head of a request on a connection without a slot [s, real time]."""

ANSWER_PATIENCE = 30.0
"""Longest time for which a client may not take any part of its answer [s, real time]."""

STOPS_ONLY = "stops only"
"""Key in the state of a request without a connection slot; only stop and abort are answered."""


class ConnectionSlots:
    """The connection slots of a listener: `most` in all, `most_each` per address, within a `share` of the descriptors.

    `without` contains connections without a slot, oldest first, which may only send a stop or abort. If their share is
    used up, a new one ends the oldest.
    """

    def __init__(self, most: int, most_each: int, share: DescriptorShare = ALL) -> None:
        self._most = most
        self._most_each = most_each
        self._taken: Counter[str] = Counter()
        self.share = share
        self.refusals: Refusals | None = None
        self.without: dict[BoundedProtocol, None] = {}

    def take(self, address: str, descriptor: int = 0) -> bool:
        """Take a slot; return whether a slot and a descriptor were free."""
        if self._taken.total() >= self._most or self._taken[address] >= self._most_each:
            return False
        if descriptor >= self.share.full:
            return False
        self._taken[address] += 1
        return True

    def end_oldest(self) -> None:
        """End the oldest connection without a slot."""
        oldest = next(iter(self.without))
        del self.without[oldest]
        oldest.transport.abort()
        if self.refusals is not None:
            self.refusals.add()

    def give_back(self, address: str) -> None:
        """Release a slot."""
        self._taken[address] -= 1
        if not self._taken[address]:
            del self._taken[address]


class BoundedProtocol(H11Protocol):
    """Takes a slot while it is open, and is cut if a head arrives too slowly, or an answer is not read."""

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
        """Take a slot; without a free one, accept only a stop or abort."""
        super().connection_made(transport)
        address = self.client[0] if self.client else ""
        connection = transport.get_extra_info("socket")
        if connection is not None:
            _require_reading(connection)
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
        """Release the slot."""
        self._leave()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read data; the head of a started request must arrive within the time limit."""
        if self._late is None and self.conn.their_state is h11.IDLE:
            self._await_head(HEAD_PATIENCE if self._place is not None else STOP_PATIENCE)
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._head_came()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Release the slot: the stream has its own limit of readers."""
        self._leave()
        super().handle_websocket_upgrade(event)

    def send_400_response(self, msg: str) -> None:
        """Refuse bytes that are not a valid request, as problem+json."""
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


def _require_reading(connection: TransportSocket) -> None:
    """Have the system end a connection whose client reads nothing; its answer would stay in memory for ever."""
    if hasattr(socket, "TCP_USER_TIMEOUT"):  # Linux
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(1e3 * ANSWER_PATIENCE))
