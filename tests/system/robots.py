"""`maya up` as a process of its own, and the way to ask it over HTTP."""

from __future__ import annotations

import http.client
import json
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from tests.system.processes import Process

LOOKS = 400
"""Number of looks for an expected event; each look waits for an event, or 0.1 s."""


@dataclass(slots=True)
class Running:
    """A `maya up` of its own and the way to ask it, with a token if there is one."""

    process: Process
    url: str
    pid: int
    token: str = ""

    def ask(self, method: str, path: str, body: object = None) -> tuple[int, Any]:
        """Return status and answer of a request."""
        connection = http.client.HTTPConnection(self.url.removeprefix("http://"), timeout=30.0)
        try:
            data = None if body is None else json.dumps(body)
            known = {"Authorization": f"Bearer {self.token}"} if self.token else {}
            connection.request(method, path, data, {"Content-Type": "application/json", **known})
            answer = connection.getresponse()
            text = answer.read()
            return answer.status, json.loads(text) if text else None
        finally:
            connection.close()

    def until(self, holds: Callable[[Any], bool], path: str = "/v1/queue") -> Any:
        """Look at something until it is so, and return it."""
        found: Any = None
        for _ in range(LOOKS):
            found = self.ask("GET", path)[1]
            if holds(found):
                return found
            last = self.ask("GET", "/v1/status")[1]["last_event"]
            self.ask("GET", f"/v1/events?since={last}&wait=0.1")
        raise AssertionError(f"it never was so: {found}")

    def end(self) -> None:
        """End it as a person does."""
        self.process.send(signal.SIGTERM)
        code, said = self.process.end()
        assert code == 0, said


@contextmanager
def up(options: str, env: Mapping[str, str] | None = None, *, cold: bool = False, port: int = 0) -> Iterator[Running]:
    """Run `maya up` while the block runs; `env` and `cold` are as for `Process`."""
    process = Process(f"up --port {port} --json {options}", env=env, quiet=True, cold=cold)
    try:
        url = process.until('"url"').split('"')[3]
        yield Running(process, url, int(process.until('"pid"').strip(",").split()[-1]))
    finally:
        process.kill()
