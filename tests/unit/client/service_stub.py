"""A scripted service over real sockets that records its requests."""

from __future__ import annotations

import json
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, NamedTuple

from maya_un.errors import MayaError
from maya_un.schema.encoding import to_data


class Asked(NamedTuple):
    """One request."""

    method: str
    path: str
    headers: dict[str, str]
    body: Any


Says = Callable[[Asked], Any]
"""From a request to its answer: a message, an error of ours to refuse it with, None to hang up without a word."""


class ServiceStub:
    """The service: its URL, and its requests, in order."""

    def __init__(self, url: str) -> None:
        self.url = url
        self.asked: list[Asked] = []

    @property
    def paths(self) -> list[str]:
        """The requests, in short."""
        return [f"{asked.method} {asked.path}" for asked in self.asked]


@contextmanager
def service(says: Says, secret: ssl.SSLContext | None = None) -> Iterator[ServiceStub]:
    """Serve the answers of `says` on a free port while the block runs; by TLS with a `secret`."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        timeout = 20.0

        def answer(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            headers = {key.lower(): value for key, value in self.headers.items()}
            asked = Asked(self.command, self.path, headers, json.loads(body) if body else None)
            stand.asked.append(asked)
            value = says(asked)
            if value is None:
                self.close_connection = True
                return
            status, text = _written(value)
            self.send_response(status)
            self.send_header("Maya", "0.1.0")
            self.send_header("Content-Length", str(len(text)))
            self.end_headers()
            self.wfile.write(text)

        do_GET = do_POST = do_PUT = do_DELETE = do_PATCH = answer  # noqa: N815 - the names that the base class looks for

        def log_message(self, format: str, *args: object) -> None:
            pass

    class Server(ThreadingHTTPServer):
        daemon_threads = True
        block_on_close = False

    with Server(("127.0.0.1", 0), Handler) as server:
        if secret is not None:
            server.socket = secret.wrap_socket(server.socket, server_side=True)
        scheme = "http" if secret is None else "https"
        stand = ServiceStub(f"{scheme}://127.0.0.1:{server.server_port}")
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield stand
        finally:
            server.shutdown()
            thread.join()


def _written(value: Any) -> tuple[int, bytes]:
    if isinstance(value, MayaError):
        problem = {"code": value.code, "details": value.details, "detail": str(value)}
        return 409, json.dumps(problem).encode()
    return 200, json.dumps(value if isinstance(value, dict | list) else to_data(value)).encode()
