"""What moves the robot, slows it or stops it. Units are m, rad, s.

A primitive is waited for: its report is returned when it is done, and why it was not is raised. Ctrl-C, or the end of
the awaiting task, cancels it, which stops the robot on its path.
"""

from __future__ import annotations

import asyncio
from collections.abc import Generator, Mapping
from typing import Any

from maya_un.client import codec
from maya_un.client.plans.asking import status
from maya_un.client.plans.jobs import cancel, ended, new_key
from maya_un.client.plans.patience import AT_REST, persistently
from maya_un.client.steps import Plan, Request, Step, post
from maya_un.controller.protocol import Jogged
from maya_un.errors import ServiceNotAnswering
from maya_un.process.report import JobReport
from maya_un.process.states import TaskState
from maya_un.values import StopReport

HURRY = 2.0
"""Longest wait for the answer to a stop [s]; it is told over a connection of its own."""

LONGEST_JOG = 3600.0
"""Longest wait for a jog [s]."""

INTERRUPTED = (KeyboardInterrupt, asyncio.CancelledError)
"""What ends a plan because nobody waits for it any more."""

_NONE = type(None)


def wish(wish: Mapping[str, object], *, timeout: float | None = None) -> Plan[JobReport]:
    """Carry out one primitive, like {"command": "pick", "target": [0.5, 1.1]}, and return its report.

    Raises why it was refused or ended early, and `TimeoutError` after `timeout` [s, real time], whereupon it goes on.
    """
    since = (yield from persistently(status())).last_event
    request = Request("POST", "/v1/tasks", JobReport, body=dict(wish), key=new_key())
    try:
        number = (yield from persistently(request)).id
    except INTERRUPTED:
        yield from _taken_back(request)
        raise
    return (yield from followed(number, since, timeout))


def _taken_back(request: Request[JobReport]) -> Plan[None]:
    """Cancel a wish whose answer nobody has heard: said again, its key is answered with the job that it became."""
    number = (yield from request).id
    yield from cancel(number)


def followed(number: int, since: int, timeout: float | None = None) -> Plan[JobReport]:
    """Wait for the end of a wish of which nothing before the event `since` is news; raises as `wish` does."""
    try:
        report = yield from ended(number, since, timeout)
    except INTERRUPTED:
        yield from cancel(number)
        raise
    if report.state is not TaskState.DONE:
        raise codec.as_error(report.code, report.message)
    return report


def jog(axis: str, distance: float, *, speed: float = 1.0, clip: bool = True) -> Plan[Jogged]:
    """Move along an axis (a, b, c; x, y, z, r of the gripper) by `distance` (rad or m); tell how far it went.

    It goes as far as the workspace allows; with `clip` false more than that is refused. Ctrl-C stops the robot.
    """
    body = {"axis": axis, "distance": distance, "speed": speed, "clip": clip}
    try:
        return (yield from Request("POST", "/v1/jog", Jogged, body=body, timeout=LONGEST_JOG))
    except INTERRUPTED:
        yield from stop()
        raise


def stop() -> Plan[StopReport]:
    """Begin to brake at once, and tell how long and how far it takes; the queue is paused where jobs wait in it.

    It goes over a connection of its own, behind nothing, and needs neither role nor lease.
    """
    return (yield from _urgently(Request("POST", "/v1/stop", StopReport, timeout=HURRY, urgent=True)))


def abort() -> Plan[None]:
    """Stop without deceleration; the motors may go off, then `recover`."""
    return (yield from _urgently(Request("POST", "/v1/abort", _NONE, timeout=HURRY, urgent=True)))


def _urgently(request: Request[Any]) -> Generator[Step, Any, Any]:
    """Ask, and once more at once over a new connection where the old one turns out to be broken."""
    try:
        return (yield from request)
    except ServiceNotAnswering:
        return (yield from request)


def pause() -> Request[StopReport]:
    """Brake on the path and hold all motion until `resume`; tell how long and how far it takes."""
    return post("/v1/pause", StopReport)


def resume() -> Request[None]:
    """Go on after a pause; raises `NotPaused`."""
    return post("/v1/resume", _NONE)


def speed(ratio: float) -> Request[None]:
    """Scale the speed of all motion, also of what is under way, by `ratio` (0.01 to 1)."""
    return post("/v1/speed", _NONE, {"ratio": ratio})


def recover(*, take_over: bool = False) -> Request[None]:
    """Clear a fault once its cause is gone; moves nothing; raises `NothingToRecover`.

    If another program owns the controller, this raises `ControllerOwned`; `take_over` takes the controller from that
    program instead, at rest.
    """
    query = {"take_over": True} if take_over else {}
    return Request("POST", "/v1/recover", _NONE, query, timeout=AT_REST)
