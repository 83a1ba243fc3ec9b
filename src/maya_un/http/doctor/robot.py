"""Checks of the running robot, from its messages as JSON: another version may have sent them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from maya_un.http.doctor.finding import Finding, fail, ok, warn


def readiness(reasons: Iterable[str], status: Mapping[str, Any] | None) -> Iterator[Finding]:
    """Check whether the service can carry out commands; `reasons` are those why not.

    It is ready only if the robot is, according to its `Status`, None for an unknown one.
    """
    found = [fail("service", "service_not_ready", message=reason) for reason in reasons]
    state = None if status is None else status["state"]
    ready = state is not None and state["homed"] and state["fault"] is None
    yield from found or [ok("service", "service_ready" if ready else "service_answers")]


def robot(status: Mapping[str, Any], datum: Mapping[str, Any]) -> Iterator[Finding]:
    """Check the state of the robot in a `Status`; its `DatumView` says how it becomes homed."""
    state, address = status["state"], status["address"]
    if state["mode"] == "disconnected":
        yield fail("robot", "robot_disconnected", address=address)
        return
    if state["fault"] is not None:
        yield fail("robot", "robot_fault", **state["fault"])
    elif not state["homed"]:
        yield warn("robot", "robot_without_datum" if datum["needed"] else "robot_not_homed", address=address)
    else:
        yield ok("robot", "robot_well", address=address, mode=state["mode"])
    yield limits(state["forward_limit"], state["reverse_limit"])


def lease(view: Mapping[str, Any]) -> Iterator[Finding]:
    """Report who drives, from a `LeaseView`."""
    if view["holder"]:
        yield ok("lease", "lease_held", holder=view["holder"], since=float(view["since"]))
    else:
        yield ok("lease", "lease_free")


def queue(view: Mapping[str, Any]) -> Iterator[Finding]:
    """Check whether the queue waits for a person, from a `QueueView`."""
    if view["recovery"] is not None:
        yield warn("queue", "queue_asks", job=view["recovery"]["job"])
    elif view["mode"] == "paused":
        waiting = view["counts"].get("queued", 0)
        yield warn("queue", "queue_paused", reason=view["reason"], waiting=waiting)
    else:
        yield ok("queue", "queue_runs")


def limits(forward: Sequence[bool], reverse: Sequence[bool]) -> Finding:
    """Return the result for active switches."""
    both = [axis for axis, plus, minus in zip("abc", forward, reverse, strict=True) if plus and minus]
    if both:
        return fail("limits", "limits_both", axes=", ".join(both))
    sides = ((forward, "+"), (reverse, "−"))
    names = [axis + sign for side, sign in sides for axis, active in zip("abc", side, strict=True) if active]
    if names:
        return warn("limits", "limits_active", names=" ".join(names))
    return ok("limits", "limits_quiet")
