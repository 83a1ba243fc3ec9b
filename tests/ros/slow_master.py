"""A way to a ROS master that is slow for one request: it holds the answer until the test has done something else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from socketserver import ThreadingMixIn
from threading import Event, Thread
from typing import Any
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer


class SlowMaster(ThreadingMixIn, SimpleXMLRPCServer):
    """Forwards requests to the master at `uri`; before the first answer to `method` of `topic`, it calls `ready`."""

    daemon_threads = True

    def __init__(self, uri: str, method: str, topic: str, ready: Callable[[], object]) -> None:
        super().__init__(("127.0.0.1", 0), logRequests=False, allow_none=True)
        self.uri = f"http://127.0.0.1:{self.server_address[1]}"
        self.held = Event()
        self._master = uri
        self._slow = (method, topic)
        self._ready = ready

    def _dispatch(self, method: str, params: Any) -> Any:
        with ServerProxy(self._master, allow_none=True) as master:
            answer = getattr(master, method)(*params)
        if (method, *params[1:2]) == self._slow and not self.held.is_set():
            self.held.set()
            self._ready()
        return answer


@contextmanager
def slow_master(uri: str, method: str, topic: str, ready: Callable[[], object]) -> Iterator[SlowMaster]:
    """Yield the way to the master while the block runs; see `SlowMaster`."""
    with SlowMaster(uri, method, topic, ready) as way:
        Thread(target=way.serve_forever, daemon=True).start()
        try:
            yield way
        finally:
            way.shutdown()
