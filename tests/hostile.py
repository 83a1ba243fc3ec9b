"""Requests that cost far more to answer than to send, and a crowd that sends them to a running Maya.

`python -m tests.hostile PORT KIND` sends those of a kind until it is killed; it says `here` when it begins.
"""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException
from random import Random
from typing import Any, NamedTuple

CROWD = 4
"""So many send at once."""

PATIENCE = 2.0
"""One of a crowd goes away after so long [s], and sends the next."""

_RNG = Random(13)
_PLACES = [[round(_RNG.uniform(0.45, 0.85), 3), round(_RNG.uniform(0.55, 0.95), 3), 0.5] for _ in range(1000)]
_LINES: dict[str, Any] = {"steps": [{"approach": _PLACES[0]}, *({"line": place} for place in _PLACES[:990])]}


class Hostile(NamedTuple):
    """A request: method, path and body."""

    method: str
    path: str
    body: bytes | None = None


def _json(value: object) -> bytes:
    return json.dumps(value).encode()


KINDS = {
    "preview of lines": Hostile("POST", "/v1/preview", _json(_LINES)),
    "inspection of lines": Hostile("POST", "/v1/inspect?samples=200", _json(_LINES)),
    "inspection with most samples": Hostile("POST", "/v1/inspect?samples=10000", _json(_LINES)),
    "preview of many parts": Hostile(
        "POST", "/v1/preview", _json({"parts": {f"p{n}": _PLACES[n % 1000] for n in range(24_000)}, "steps": ["home"]})
    ),
    "held job of lines": Hostile("POST", "/v1/jobs?held=true", _json(_LINES)),
    "many keys": Hostile("POST", "/v1/preview", b'{"a":{' + b",".join(b'"%d":1' % n for n in range(80_000)) + b"}}"),
    "many numbers": Hostile("POST", "/v1/preview", b'{"a":[' + b",".join([b"1"] * 480_000) + b"]}"),
    "deep nesting": Hostile("POST", "/v1/jobs", b'{"a":' + b"[" * 400_000 + b"]" * 400_000 + b"}"),
    "a place far out of reach": Hostile("GET", "/v1/reach?x=-2.2&y=3.3&z=2.0"),
}
"""Every kind by its name."""

HARMLESS = Hostile("POST", "/v1/preview", b" " * 900_000)
"""As long as the longest, and refused at once: what carrying it costs, and nothing else."""


def said(port: int, request: Hostile, patience: float = 60.0) -> tuple[int, Any]:
    """Send a request; return the status and the answer."""
    connection = HTTPConnection("127.0.0.1", port, timeout=patience)
    try:
        connection.request(request.method, request.path, request.body, {"Content-Type": "application/json"})
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


@dataclass
class Crowd:
    """Those who send: `left` requests of a kind are still to be sent."""

    left: int


@contextmanager
def crowded(port: int, request: Hostile, count: int) -> Iterator[Crowd]:
    """Have a crowd send `count` requests in all; the block begins when the first are on their way."""
    crowd, lock, began = Crowd(count), threading.Lock(), threading.Barrier(CROWD + 1)

    def send() -> None:
        began.wait()
        while True:
            with lock:
                if crowd.left <= 0:
                    return
                crowd.left -= 1
            with suppress(OSError, HTTPException):
                said(port, request, PATIENCE)

    threads = [threading.Thread(target=send, daemon=True) for _ in range(CROWD)]
    for thread in threads:
        thread.start()
    began.wait()
    try:
        yield crowd
    finally:
        for thread in threads:
            thread.join()


def main() -> None:
    """Send without end."""
    with crowded(int(sys.argv[1]), KINDS[sys.argv[2]], sys.maxsize):
        print("here", flush=True)


if __name__ == "__main__":
    main()
