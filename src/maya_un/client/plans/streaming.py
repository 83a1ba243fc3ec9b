"""The stream of the service: events without gaps across lost connections, and states."""

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
"""Total waiting time for an unreachable service before a stream ends with that error [s]."""


@dataclass(frozen=True, slots=True)
class Event:
    """An event: number `seq` of the run `run` of the service, `time` [s], kind, code (0 for none), details.

    Each start of the service with the same stored queue is a run, counted from 1. Event numbers start at 1 in each run.
    """

    run: int
    seq: int
    time: float
    kind: str
    code: int
    detail: Mapping[str, Any]


def events(*, since: int | None = None, run: int | None = None, patience: float = PATIENCE) -> StreamPlan[Event]:
    """Yield every event after number `since` of `run`, in order, without repetition or gap.

    Without `since`, start with the next event; without `run`, `since` is a number of the current run. If the connection
    breaks, it continues after the last event; after a restart of the service it yields the new run from the beginning.
    Raises `EventsForgotten` for events that are no longer stored, and `ServiceNotRunning` or `ServiceNotAnswering`
    after `patience` [s, real time] without a connection.
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
    """Yield the changing state, at most `rate` times a second (0.1 to 100).

    A slow reader gets only the newest state. Raises as `events` does.
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
    """Pauses between attempts, each twice as long as the last, up to a total of `patience` [s]."""

    def __init__(self, patience: float) -> None:
        self._left = patience
        self._rest = SHORTEST_PAUSE

    def after(self, error: Exception) -> Generator[Step, Any, None]:
        """Pause after a failure, or raise it if the total pause is used up."""
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
    """Return the next message, or the newest of those that have already arrived."""
    found = yield from _next(line)
    while (text := (yield from Receive(line, now=True))) is not None:
        found = transport.decoded_message(text)
    return found
