"""Drivers and their times, from the event log alone: it knows the words of the events, and no code of the lease."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from maya_un.events import Event, LeaseChanged

NEW = {"taken", "handed over", "broken"}
"""Changes after which somebody drives."""

GONE = {"released", "expired", "removed"}
"""Changes after which nobody does."""

TALK = {"offered", "asked"}


@dataclass(frozen=True, slots=True)
class Span:
    """`name` drove from event `since` on, up to event `until`, that one left out; times in s."""

    name: str
    since: int
    until: float
    began: float
    ended: float


class Inconsistent(AssertionError):
    """The log contradicts itself."""


def spans(events: Iterable[Event]) -> list[Span]:
    """Return who drove when, in order; raises `Inconsistent` where two did, or the log does not hang together."""
    found: list[Span] = []
    driver, since, began, last = "", 0, 0.0, 0
    for event in events:
        if event.seq != last + 1:
            raise Inconsistent(f"event {event.seq} follows {last}")
        last = event.seq
        if not isinstance(event, LeaseChanged):
            continue
        change, holder = str(event.detail["change"]), str(event.detail["holder"])
        if change in TALK:
            _same(event, holder, driver)
            continue
        _same(event, str(event.detail["before"]), driver)
        if (change in NEW) is not bool(holder) or change not in NEW | GONE:
            raise Inconsistent(f"{event}: {change} leaves {holder!r}")
        if driver:
            found.append(Span(driver, since, event.seq, began, event.time))
        driver, since, began = holder, event.seq, event.time
    if driver:
        found.append(Span(driver, since, float("inf"), began, float("inf")))
    return found


def driver_at(log: list[Span], seq: int) -> str:
    """Return who drove once event `seq` had happened, and nothing after it."""
    return next((span.name for span in log if span.since <= seq < span.until), "")


def _same(event: Event, said: str, known: str) -> None:
    if said != known:
        raise Inconsistent(f"{event}: it says that {said!r} drove, but it was {known!r}")
