"""Requests that cost far more to answer than to send, and clients that send them to a running Maya.

`python -m tests.costly_requests PORT KIND` sends requests of a kind until it is killed; it prints `here` when it
begins.
"""

from __future__ import annotations

import json
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.client import HTTPConnection, HTTPException
from random import Random
from typing import Any, NamedTuple

CROWD = 4
"""Number of clients that send at once."""

PATIENCE = 2.0
"""A client leaves after this time [s], and sends the next request."""

_RNG = Random(13)
_PLACES = [[round(_RNG.uniform(0.45, 0.85), 3), round(_RNG.uniform(0.55, 0.95), 3), 0.5] for _ in range(1000)]
_LINES: dict[str, Any] = {"steps": [{"approach": _PLACES[0]}, *({"line": place} for place in _PLACES[:990])]}


class CostlyRequest(NamedTuple):
    """A request: method, path and body."""

    method: str
    path: str
    body: bytes | None = None


def _json(value: object) -> bytes:
    return json.dumps(value).encode()


KINDS = {
    "preview of lines": CostlyRequest("POST", "/v1/preview", _json(_LINES)),
    "inspection of lines": CostlyRequest("POST", "/v1/inspect?samples=200", _json(_LINES)),
    "inspection with most samples": CostlyRequest("POST", "/v1/inspect?samples=10000", _json(_LINES)),
    "preview of many parts": CostlyRequest(
        "POST", "/v1/preview", _json({"parts": {f"p{n}": _PLACES[n % 1000] for n in range(24_000)}, "steps": ["home"]})
    ),
    "held job of lines": CostlyRequest("POST", "/v1/jobs?held=true", _json(_LINES)),
    "change of a job of lines": CostlyRequest("PATCH", "/v1/jobs/{job}", _json({"job": _LINES})),
    "report of a job of lines": CostlyRequest("GET", "/v1/jobs/{job}"),
    "page of jobs": CostlyRequest("GET", "/v1/jobs?limit=1000"),
    "view of the queue": CostlyRequest("GET", "/v1/queue"),
    "many keys": CostlyRequest(
        "POST", "/v1/preview", b'{"a":{' + b",".join(b'"%d":1' % n for n in range(80_000)) + b"}}"
    ),
    "many numbers": CostlyRequest("POST", "/v1/preview", b'{"a":[' + b",".join([b"1"] * 480_000) + b"]}"),
    "deep nesting": CostlyRequest("POST", "/v1/jobs", b'{"a":' + b"[" * 400_000 + b"]" * 400_000 + b"}"),
    "a place far out of reach": CostlyRequest("GET", "/v1/reach?x=-2.2&y=3.3&z=2.0"),
}
"""Every kind by its name; `{job}` stands for the number of a held job (see `prepared`)."""

ANSWERS = {200, 202, 400, 409, 413, 422, 429}
"""Every status that may answer a hostile request."""

HARMLESS = CostlyRequest("POST", "/v1/preview", b" " * 900_000)
"""As long as the longest, and refused at once: this shows the cost of transport alone."""


def send_request(port: int, request: CostlyRequest, patience: float = 60.0) -> tuple[int, Any]:
    """Send a request; return the status and the answer."""
    connection = HTTPConnection("127.0.0.1", port, timeout=patience)
    try:
        connection.request(request.method, request.path, request.body, {"Content-Type": "application/json"})
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


def prepared(port: int, kind: str) -> CostlyRequest:
    """Return a request of a kind, after what it needs: a held job of lines."""
    request = KINDS[kind]
    if "{job}" not in request.path:
        return request
    status, answer = send_request(port, KINDS["held job of lines"])
    assert status == 202, answer
    return request._replace(path=request.path.format(job=json.loads(answer)["id"]))


@dataclass
class CostlyClients:
    """The clients that send: `left` requests of a kind are still to be sent.

    `statuses` counts the answers, `given_up` the requests for whose answer nobody waited any more, and `dropped` has
    how the service closed a connection without an answer.
    """

    left: int
    statuses: Counter[int] = field(default_factory=Counter[int])
    given_up: int = 0
    dropped: list[str] = field(default_factory=list[str])


@contextmanager
def costly_clients(port: int, request: CostlyRequest, count: int) -> Iterator[CostlyClients]:
    """Have clients send `count` requests in all; the block begins when the first are on their way."""
    crowd, lock, began = CostlyClients(count), threading.Lock(), threading.Barrier(CROWD + 1)

    def send() -> None:
        began.wait()
        while True:
            with lock:
                if crowd.left <= 0:
                    return
                crowd.left -= 1
            try:
                crowd.statuses[send_request(port, request, PATIENCE)[0]] += 1
            except TimeoutError:
                crowd.given_up += 1
            except (OSError, HTTPException) as error:
                crowd.dropped.append(repr(error))

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
    with costly_clients(int(sys.argv[1]), prepared(int(sys.argv[1]), sys.argv[2]), sys.maxsize):
        print("here", flush=True)


if __name__ == "__main__":
    main()
