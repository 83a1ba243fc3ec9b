"""Many clients of a robot's HTTP interface, as a separate process: one thread, connection and token for each.

`python -m tests.load_clients` reads its orders as JSON from its input and prints the results. Instants are of the
system's
monotonic clock, which all processes share.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from dataclasses import asdict, dataclass, field
from http.client import HTTPConnection, HTTPException
from random import Random
from typing import Any

DRIVING = {"jog": 8, "renew": 4, "speed": 3, "release": 2, "vanish": 2, "stop": 1}
WAITING = {"take": 20, "force": 2, "ask": 2, "jog": 3, "vanish": 2, "stop": 2}

_PATHS = {
    "take": ("POST", "/v1/lease", {"patience": 2.0}),
    "force": ("POST", "/v1/lease", {"patience": 2.0, "force": True}),
    "renew": ("POST", "/v1/lease/renew", None),
    "release": ("DELETE", "/v1/lease", None),
    "ask": ("POST", "/v1/lease/ask", None),
    "stop": ("POST", "/v1/stop", None),
}


@dataclass(slots=True)
class Outcome:
    """Number of answers by status, instants and statuses of stops, and requests that failed."""

    statuses: dict[str, int] = field(default_factory=dict[str, int])
    stops: list[tuple[float, int]] = field(default_factory=list[tuple[float, int]])
    broken: list[str] = field(default_factory=list[str])


class Person(threading.Thread):
    """Somebody who does `count` things, one after the other."""

    def __init__(self, address: tuple[str, int], token: str, count: int, seed: str, outcome: Outcome) -> None:
        super().__init__(daemon=True)
        self._address = address
        self._token = token
        self._count = count
        self._rng = Random(seed)
        self._outcome = outcome
        self._lease = ""
        self._connection = HTTPConnection(*address, timeout=30.0)

    def run(self) -> None:
        """Live."""
        idle = threading.Event()
        idle.wait(self._rng.uniform(0.0, 1.0))
        for _ in range(self._count):
            habit = DRIVING if self._lease else WAITING
            self._do(self._rng.choices(list(habit), list(habit.values()))[0])
            idle.wait(self._rng.choice([0.0, 0.02, 0.2] if self._lease else [0.0, 0.1, 0.5, 1.5]))
        self._connection.close()

    def _do(self, request: str) -> None:
        if request == "vanish":
            self._connection.close()
            self._connection = HTTPConnection(*self._address, timeout=30.0)
            self._lease = ""
            return
        if request == "jog":
            way = ("POST", "/v1/jog", {"axis": "a", "distance": self._rng.choice([-1.0, 1.0])})
        elif request == "speed":
            way = ("POST", "/v1/speed", {"ratio": self._rng.choice([0.5, 1.0])})
        else:
            way = _PATHS[request]
        self._ask(request, *way)

    def _ask(self, request: str, method: str, path: str, body: dict[str, Any] | None) -> None:
        headers = {"Authorization": f"Bearer {self._token}", "Content-Type": "application/json"}
        if self._lease:
            headers["Maya-Lease"] = self._lease
        asked = time.monotonic()
        try:
            self._connection.request(method, path, None if body is None else json.dumps(body), headers)
            response = self._connection.getresponse()
            answer = json.loads(response.read())
        except (OSError, HTTPException) as error:
            self._outcome.broken.append(f"{request}: {error!r}")
            self._connection.close()
            return
        self._note(request, response.status, answer, asked)

    def _note(self, request: str, status: int, answer: Any, asked: float) -> None:
        key = f"{request} {status}"
        self._outcome.statuses[key] = self._outcome.statuses.get(key, 0) + 1
        if request == "stop":
            self._outcome.stops.append((asked, status))
        if request in {"take", "force"} and status == 200:
            self._lease = answer["id"]
        elif request == "release" or (status == 409 and answer.get("code") == 4105):
            self._lease = ""


def main() -> None:
    """Run the orders of the input: {"address": [host, port], "tokens": [...], "count": n, "seed": text}."""
    asked = json.loads(sys.stdin.read())
    outcome = Outcome()
    host, port = asked["address"]
    people = [
        Person((host, port), token, asked["count"], f"{asked['seed']} {n}", outcome)
        for n, token in enumerate(asked["tokens"])
    ]
    for person in people:
        person.start()
    for person in people:
        person.join()
    print(json.dumps(asdict(outcome)))


if __name__ == "__main__":
    main()
