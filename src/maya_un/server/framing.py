"""Refuse requests with an ambiguous end (RFC 9112, 2.2, 5.2, 6.1 and 6.3).

If a proxy before the service finds another end, it takes data of one client for the request of another. h11 refuses
most such requests; this module refuses those that h11 repairs or leaves to the server.
"""

from __future__ import annotations

from collections import Counter

import h11

_LENGTH, _CODING = b"content-length", b"transfer-encoding"
_ONCE = (_LENGTH, _CODING, b"authorization", b"maya-lease", b"upgrade")
_VERSIONS = frozenset({b"1.0", b"1.1"})


class StrictConnection(h11.Connection):
    """The server's side of a connection by HTTP/1; `next_event` raises `RemoteProtocolError` for doubtful heads too."""

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
        """Begin with the next request."""
        super().start_next_cycle()
        self._head = bytearray(self.trailing_data[0])


def doubtful(head: bytes, version: bytes) -> str:
    """Return why the head of a request, of this version of HTTP, is refused; "" where it is not."""
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
