"""The stream of the service: events without a gap, whatever happens to the connection; states as they are."""

from __future__ import annotations

import json
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any

from maya_un.client import transport
from maya_un.client.steps import (
    LONGEST_PAUSE,
    SHORTEST_PAUSE,
    Connect,
    Emit,
    Line,
    Plan,
    Receive,
    Send,
    Sleep,
    Step,
    StreamPlan,
)
from maya_un.errors import ServiceNotAnswering, ServiceNotRunning, StreamLagging
from maya_un.values import State

PATH = "/v1/stream"

PATIENCE = 60.0
"""So long it rests, all in all, for a service that is not there, before a stream ends with that error [s]."""


@dataclass(frozen=True, slots=True)
class Event:
    """One fact: number `seq` of the run `run` of the service, loop time [s], kind, code (0 where none), details.

    Runs are counted from the first start of the service on its file; numbers begin at 1 in each.
    """

    run: int
    seq: int
    time: float
    kind: str
    code: int
    detail: Mapping[str, Any]


def events(*, since: int | None = None, run: int | None = None, patience: float = PATIENCE) -> StreamPlan[Event]:
    """Yield every event after number `since` of `run`, in order, none twice and none left out.

    Without `since` from now on, without `run` of the run that there is. If the connection breaks, it continues after
    the last event; after a restart of the service it yields the new run from the beginning. Raises `EventsForgotten`
    for what is not kept any more, and `ServiceNotRunning` or `ServiceNotAnswering` after `patience` [s, real time]
    without one.
    """
    place: dict[str, int] = {key: value for key, value in (("since", since), ("run", run)) if value is not None}
    wait = _Backoff(patience)
    while True:
        try:
            line, greeting = yield from _greeted()
            place = {"since": greeting["last_event"], "run": greeting["run"], **place}
            yield from Send(line, {"type": "subscribe", "events": place})
            while True:
                found = yield from _next(line)
                if found["type"] == "restart":
                    place = {"since": 0, "run": int(found["run"])}
                elif found["type"] == "event":
                    event = Event(int(found["run"]), **found["event"])
                    place = {"since": event.seq, "run": event.run}
                    wait = _Backoff(patience)
                    yield Emit(event)
        except (ServiceNotAnswering, ServiceNotRunning, StreamLagging) as error:
            yield from wait.after(error)


def states(*, rate: float = 10.0, patience: float = PATIENCE) -> StreamPlan[State]:
    """Yield the state now and then as it changes, at most `rate` times a second (0.1 to 100).

    A slow reader gets the newest one. Raises as `events` does.
    """
    wait = _Backoff(patience)
    while True:
        try:
            line, _ = yield from _greeted()
            yield from Send(line, {"type": "subscribe", "state": {"rate": rate}})
            while True:
                found = yield from _newest(line)
                if found["type"] == "state":
                    wait = _Backoff(patience)
                    yield Emit(transport.adapter(State).validate_json(json.dumps(found["state"])))
        except (ServiceNotAnswering, ServiceNotRunning) as error:
            yield from wait.after(error)


class _Backoff:
    """Rests between tries, longer each time, until the patience is over."""

    def __init__(self, patience: float) -> None:
        self._left = patience
        self._rest = SHORTEST_PAUSE

    def after(self, error: Exception) -> Generator[Step, Any, None]:
        """Rest after a failure, or raise it where there is no patience left."""
        if self._left <= 0.0:
            raise error
        pause = min(self._rest, LONGEST_PAUSE)
        self._left -= pause
        self._rest = 2.0 * pause
        yield from Sleep(pause)


def _greeted() -> Plan[tuple[Line, dict[str, Any]]]:
    line = yield from Connect(PATH)
    return line, (yield from _next(line))


def _next(line: Line) -> Plan[dict[str, Any]]:
    text = yield from Receive(line)
    assert text is not None
    return transport.decoded_message(text)


def _newest(line: Line) -> Plan[dict[str, Any]]:
    """Return the next message, or the last of those that have come already."""
    found = yield from _next(line)
    while (text := (yield from Receive(line, now=True))) is not None:
        found = transport.decoded_message(text)
    return found
