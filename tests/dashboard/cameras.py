"""A small camera: pictures over HTTP, one after the other or single ones, and its faults."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from time import monotonic
from typing import Any, Literal

from PIL import Image

BOUNDARY = "picture"
FRAME = 0.05
"""Time between two pictures of the stream [s]."""

SIZE = (64, 48)

Mood = Literal["well", "hanging", "ending"]


def picture_of(colour: str) -> bytes:
    """Return a picture in one colour. It is not compressed: browsers wait for some kB of a stream."""
    file = io.BytesIO()
    Image.new("RGB", SIZE, colour).save(file, "PNG", compress_level=0)
    return file.getvalue()


class CameraServer:
    """Serves `/stream` and `/snapshot`.

    While `mood` is "hanging" it sends nothing, neither to new requests nor in streams under way; while it is "ending",
    streams end after some pictures. A snapshot takes `delay` [s]. `asked` are the times of requests [s], `open` is the
    number of those under way, and `most` the largest such number.
    """

    def __init__(self) -> None:
        self.mood: Mood = "well"
        self.colour = "red"
        self.delay = 0.0
        self.asked: list[float] = []
        self.open = 0
        self.most = 0
        self.ended = threading.Event()
        self._lock = threading.Lock()
        camera = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                with suppress(BrokenPipeError, ConnectionResetError):
                    if self.path.startswith("/stream"):
                        with camera.under_way():
                            camera.send_stream(self)
                    else:
                        camera.send_snapshot(self)
                self.close_connection = True

            def log_message(self, format: str, *args: Any) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}"

    @contextmanager
    def under_way(self) -> Iterator[None]:
        """Count a request."""
        with self._lock:
            self.asked.append(monotonic())
            self.open += 1
            self.most = max(self.most, self.open)
        try:
            yield
        finally:
            with self._lock:
                self.open -= 1

    def send_snapshot(self, to: BaseHTTPRequestHandler) -> None:
        """Send one picture. With its last byte, the client may ask again: then the request is over."""
        with self.under_way():
            self.ended.wait(self.delay)
            if self._hangs(to):
                return
        content = picture_of(self.colour)
        to.send_response(200)
        to.send_header("Content-Type", "image/png")
        to.send_header("Content-Length", str(len(content)))
        to.end_headers()
        to.wfile.write(content)

    def send_stream(self, to: BaseHTTPRequestHandler) -> None:
        """Send pictures until the client leaves."""
        if self._hangs(to):
            return
        to.send_response(200)
        to.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={BOUNDARY}")
        to.end_headers()
        to.wfile.write(f"--{BOUNDARY}\r\n".encode())
        left = 4
        while not self._hangs(to) and left and not self.ended.wait(FRAME):
            content = picture_of(self.colour)
            head = f"Content-Type: image/png\r\nContent-Length: {len(content)}\r\n\r\n".encode()
            to.wfile.write(head + content + f"\r\n--{BOUNDARY}\r\n".encode())
            left -= self.mood == "ending"

    def _hangs(self, to: BaseHTTPRequestHandler) -> bool:
        """Say nothing until the client leaves, if the camera hangs."""
        if self.mood != "hanging":
            return False
        to.connection.settimeout(60.0)
        with suppress(OSError):
            to.connection.recv(1)
        return True


@contextmanager
def camera_server() -> Iterator[CameraServer]:
    """Run a camera while the block runs."""
    camera = CameraServer()
    thread = threading.Thread(target=camera.server.serve_forever)
    thread.start()
    yield camera
    camera.ended.set()
    camera.server.shutdown()
    thread.join()
    camera.server.server_close()
