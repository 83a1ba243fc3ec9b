"""Small servers that say what a test wants: an HTTP service, one that hangs, a controller."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

Answer = Callable[[str, str, Any], tuple[int, object]]
"""From method, path and body to status and answer."""


@contextmanager
def http_service(says: Answer, *, ours: bool = True) -> Iterator[str]:
    """Serve the answers of `says` on a free port while the block runs, as ours or a stranger; yields the URL."""

    class Handler(BaseHTTPRequestHandler):
        def answer(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            status, value = says(self.command, self.path, json.loads(body) if body else None)
            text = value if isinstance(value, bytes) else json.dumps(value).encode()
            self.send_response(status)
            self.send_header("Content-Length", str(len(text)))
            if ours:
                self.send_header("Maya", "0.0")
            self.end_headers()
            self.wfile.write(text)

        do_GET = do_POST = do_PUT = do_PATCH = do_DELETE = answer  # noqa: N815 - the names that the base class looks for

        def log_message(self, format: str, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


@contextmanager
def hanging_service() -> Iterator[str]:
    """Accept connections and never answer, as a stopped process does; yields the URL."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"


@contextmanager
def controller(record: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Accept one connection and answer QR with `record`, everything else with a prompt; yields port and commands."""
    said: list[bytes] = []

    def serve() -> None:
        connection, _ = listener.accept()
        with connection, connection.makefile("rb") as lines:
            waiting = b""
            while byte := lines.read(1):
                waiting += byte
                if byte == b"\r":
                    said.append(waiting.strip())
                    connection.sendall(record + b":" if waiting == b"QR\r" else b":")
                    waiting = b""

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve)
        thread.start()
        yield listener.getsockname()[1], said
        thread.join()
