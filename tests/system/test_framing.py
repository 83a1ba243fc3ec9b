"""Requests whose end is doubtful are refused and their connection closed, by bare sockets at the real server.

Behind each stands a second request, which a reader that finds another end would answer, or hide.
"""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import suppress
from urllib.parse import urlsplit

import pytest

from tests.shared_robot import SharedRobot, shared_robot

pytestmark = pytest.mark.system

PATIENCE = 20.0
HOST = b"Host: 127.0.0.1\r\n"
STOP = b"POST /v1/stop HTTP/1.1\r\n" + HOST
NEXT = b"GET /v1/health HTTP/1.1\r\n" + HOST + b"\r\n"
LAST = b"GET /v1/health HTTP/1.1\r\n" + HOST + b"Connection: close\r\n\r\n"
CHUNKED = b"Transfer-Encoding: chunked\r\n"
NO_LENGTH = b"Content-Length: 0\r\n\r\n"
END = b"0\r\n\r\n"
SOCKET = (
    b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)

REFUSED = {
    "length, then coding": STOP + b"Content-Length: 5\r\n" + CHUNKED + b"\r\n" + END,
    "coding, then length": STOP + CHUNKED + b"Content-Length: 5\r\n\r\n" + END,
    "two lengths that differ": STOP + b"Content-Length: 5\r\n" + NO_LENGTH,
    "two lengths that agree": STOP + b"Content-Length: 0\r\n" + NO_LENGTH,
    "a list of lengths": STOP + b"Content-Length: 0, 0\r\n\r\n",
    "a length with a sign": STOP + b"Content-Length: +0\r\n\r\n",
    "a negative length": STOP + b"Content-Length: -1\r\n\r\n",
    "a hexadecimal length": STOP + b"Content-Length: 0x0\r\n\r\n",
    "an empty length": STOP + b"Content-Length:\r\n\r\n",
    "a length of two words": STOP + b"Content-Length: 0 0\r\n\r\n",
    "a length beyond all numbers": STOP + b"Content-Length: " + b"9" * 30 + b"\r\n\r\n",
    "two codings": STOP + CHUNKED + CHUNKED + b"\r\n" + END,
    "a list of codings": STOP + b"Transfer-Encoding: chunked, chunked\r\n\r\n" + END,
    "identity": STOP + b"Transfer-Encoding: identity\r\n\r\n",
    "compressed and chunked": STOP + b"Transfer-Encoding: gzip, chunked\r\n\r\n" + END,
    "nearly chunked": STOP + b"Transfer-Encoding: xchunked\r\n\r\n" + END,
    "chunked behind a vertical tab": STOP + b"Transfer-Encoding: \x0bchunked\r\n\r\n" + END,
    "chunked by HTTP/1.0": STOP.replace(b"1.1", b"1.0") + CHUNKED + b"\r\n" + END,
    "a chunk of a hexadecimal prefix": STOP + CHUNKED + b"\r\n0x0\r\n\r\n",
    "a negative chunk": STOP + CHUNKED + b"\r\n-1\r\n\r\n",
    "a chunk with a sign": STOP + CHUNKED + b"\r\n+0\r\n\r\n",
    "a chunk beyond all numbers": STOP + CHUNKED + b"\r\n" + b"f" * 30 + b"\r\n\r\n",
    "a chunk behind a space": STOP + CHUNKED + b"\r\n 0\r\n\r\n",
    "a chunk with bare line feeds": STOP + CHUNKED + b"\r\n0\n\n",
    "a chunk longer than it says": STOP + CHUNKED + b"\r\n1\r\naXX" + END,
    "a line feed in a chunk's extension": STOP + CHUNKED + b"\r\n0;a\nb\r\n\r\n",
    "a header in two lines": STOP + b"X-A: b\r\n c\r\n" + NO_LENGTH,
    "a coding in two lines": STOP + b"Transfer-Encoding:\r\n chunked\r\n\r\n" + END,
    "a length in two lines": STOP + b"Content-Length:\r\n\t0\r\n\r\n",
    "a header that begins with a space": STOP + b" " + NO_LENGTH,
    "a first header that begins with a space": b"POST /v1/stop HTTP/1.1\r\n " + HOST + NO_LENGTH,
    "bare line feeds": (STOP + NO_LENGTH).replace(b"\r\n", b"\n"),
    "one bare line feed": STOP + b"X: a\n" + NO_LENGTH,
    "a bare carriage return": STOP + b"X: a\r" + NO_LENGTH,
    "NUL in a value": STOP + b"X: a\0b\r\n" + NO_LENGTH,
    "NUL in a name": STOP + b"X\0: a\r\n" + NO_LENGTH,
    "a space before the colon": STOP + b"Content-Length : 0\r\n\r\n",
    "a coding with a space before the colon": STOP + b"Transfer-Encoding : chunked\r\n\r\n" + END,
    "no name": STOP + b": x\r\n" + NO_LENGTH,
    "no colon": STOP + b"abc\r\n" + NO_LENGTH,
    "two hosts": STOP + b"Host: elsewhere\r\n" + NO_LENGTH,
    "no host": b"POST /v1/stop HTTP/1.1\r\n" + NO_LENGTH,
    "two tokens": STOP + b"Authorization: Bearer a\r\nAuthorization: Bearer b\r\n" + NO_LENGTH,
    "two leases": STOP + b"Maya-Lease: a\r\nMaya-Lease: b\r\n" + NO_LENGTH,
    "no version": b"GET /v1/health\r\n\r\n",
    "another version": NEXT.replace(b"1.1", b"2.0"),
    "a version that there is not": NEXT.replace(b"1.1", b"1.2"),
    "two spaces": NEXT.replace(b"GET ", b"GET  "),
    "a tab between": NEXT.replace(b"GET ", b"GET\t"),
    "a websocket with a length": NEXT[:-2].replace(b"health", b"stream") + SOCKET + b"Content-Length: 5\r\n\r\nabcde",
    "a websocket with a coding": NEXT[:-2].replace(b"health", b"stream") + SOCKET + CHUNKED + b"\r\n" + END,
}

TAKEN = {
    "a length": STOP + NO_LENGTH,
    "chunked": STOP + CHUNKED + b"\r\n" + END,
    "chunked in parts": STOP + CHUNKED + b"\r\n1\r\n{\r\n01\r\n}\r\n" + END,
    "chunked with an extension": STOP + CHUNKED + b"\r\n0;a=b\r\n\r\n",
    "a trailer that says another length": STOP + CHUNKED + b"\r\n0\r\nContent-Length: 5\r\n\r\n",
    "a tab before a value": STOP + b"Content-Length:\t0\r\n\r\n",
    "a name like another": STOP + b"Content_Length: 5\r\n" + NO_LENGTH,
    "a request in the body of another": NEXT[:-2] + b"Content-Length: %d\r\n\r\n" % len(NEXT) + NEXT,
}


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedRobot]:
    with shared_robot(tmp_path_factory.mktemp("framing"), users=False) as one:
        yield one


def answered(robot: SharedRobot, *parts: bytes) -> list[bytes]:
    """Return the answers to what is sent in these parts, up to the end of the connection."""
    place = urlsplit(robot.url)
    said = b""
    with socket.create_connection((place.hostname, place.port), timeout=PATIENCE) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with suppress(BrokenPipeError, ConnectionResetError):  # it was closed before all was sent
            for part in parts:
                connection.sendall(part)
        with suppress(ConnectionResetError):
            while found := connection.recv(65_536):
                said += found
    return said.split(b"HTTP/1.1 ")[1:]


@pytest.mark.parametrize("case", REFUSED)
def test_doubtful_framing_is_refused_and_the_connection_closed(robot: SharedRobot, case: str) -> None:
    (answer,) = answered(robot, REFUSED[case] + NEXT)
    assert answer.startswith(b"400")
    assert b'"code":4005' in answer.replace(b" ", b"")


@pytest.mark.parametrize("case", TAKEN)
def test_plain_framing_is_taken_and_the_next_request_answered(robot: SharedRobot, case: str) -> None:
    answers = answered(robot, TAKEN[case] + LAST)
    assert [one[:3] for one in answers][-1:] == [b"200"]
    assert len(answers) == 2


@pytest.mark.parametrize("case", ["length, then coding", "a header in two lines", "one bare line feed"])
def test_doubtful_framing_is_refused_however_it_arrives(robot: SharedRobot, case: str) -> None:
    whole = NEXT + REFUSED[case]
    answers = answered(robot, *(whole[at : at + 1] for at in range(len(whole))))
    assert [one[:3] for one in answers] == [b"200", b"400"]
