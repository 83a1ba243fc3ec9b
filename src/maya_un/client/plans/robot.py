"""Plans that report on the robot, preview its jobs, move it or stop it. Units are m, rad, s.

A primitive is waited for: the plan returns its report, or raises the error that refused or ended it. Ctrl-C, or the end
of the awaiting task, cancels it, which stops the robot on its path.
"""

from __future__ import annotations

import asyncio
from collections.abc import Generator, Mapping
from typing import TYPE_CHECKING, Any

from maya_un.client import requests, transport
from maya_un.client.jobs import JobLike, body_of
from maya_un.client.plans.jobs import ended, new_key
from maya_un.client.request import Request
from maya_un.client.steps import Plan, Step, persistently
from maya_un.errors import ServiceNotAnswering
from maya_un.schema.jobs import JobReport, TaskState
from maya_un.schema.robot import Jogged
from maya_un.values import StopReport

if TYPE_CHECKING:
    from maya_un.schema.previews import JobInspection, JobPreview
    from maya_un.values import Point, State


def state() -> Plan[State]:
    """Return the latest state of the machine."""
    return (yield from requests.status()).state


def twin_parts() -> Plan[dict[str, Point]]:
    """Return the positions of the parts on the twin's table [m]; raises `NotFound` on a real machine."""
    return (yield from requests.twin()).parts


def preview(job: JobLike) -> Request[JobPreview]:
    """Return the preview of a job from the current position: times, heights, and the first refusal; nothing moves."""
    return requests.preview(body_of(job))


def inspect(job: JobLike, *, samples: int = 200) -> Request[JobInspection]:
    """Return a job in detail: profiles of the axes, smallest margins, the longest stop; nothing moves.

    `samples` is the number of samples per motion.
    """
    return requests.inspect(body_of(job), samples=samples)


INTERRUPTED = (KeyboardInterrupt, asyncio.CancelledError)
"""Errors that interrupt a plan from outside."""


def command(command: Mapping[str, object], *, timeout: float | None = None) -> Plan[JobReport]:
    """Carry out one primitive, like {"command": "pick", "target": [0.5, 1.1]}, and return its report.

    Raises the error that refused or ended the primitive, and `TimeoutError` after `timeout` [s, real time]; the
    primitive then continues.
    """
    since = (yield from persistently(requests.status())).last_event
    request = requests.task(dict(command), key=new_key())
    try:
        number = (yield from persistently(request)).id
    except INTERRUPTED:
        yield from _taken_back(request)
        raise
    return (yield from followed(number, since, timeout))


def _taken_back(request: Request[JobReport]) -> Plan[None]:
    """Cancel a command whose answer was lost: repeating the request with its key returns the number of its job."""
    number = (yield from request.urgently()).id
    yield from requests.cancel(number).urgently()


def followed(number: int, since: int, timeout: float | None = None) -> Plan[JobReport]:
    """Wait for the end of a command; `since` is the number of an event before it. Raises as `command` does."""
    try:
        report = yield from ended(number, since, timeout)
    except INTERRUPTED:  # the connection may be locked where Ctrl-C interrupted it
        yield from requests.cancel(number).urgently()
        raise
    if report.state is not TaskState.DONE:
        raise transport.as_error(report.code, report.message)
    return report


def jog(axis: str, distance: float, *, speed: float = 1.0, clip: bool = True) -> Plan[Jogged]:
    """Move along an axis (a, b, c; x, y, z, r of the gripper) by `distance` (rad or m); return the distance moved.

    It moves as far as the workspace allows; with `clip` false, a longer distance is refused. Ctrl-C stops the robot.
    """
    try:
        return (yield from requests.jog_by(axis, distance, speed=speed, clip=clip))
    except INTERRUPTED:
        yield from stop()
        raise


def stop() -> Plan[StopReport]:
    """Start braking at once; return the time and distance to rest. If jobs wait, the queue is paused.

    It uses a separate connection, so it waits for no other request, and needs no lease and no
    particular role. From another computer it needs a token.
    """
    return (yield from _urgently(requests.stop()))


def abort() -> Plan[None]:
    """Stop without deceleration; the motors may go off, then `recover` switches them on."""
    return (yield from _urgently(requests.abort()))


def _urgently(request: Request[Any]) -> Generator[Step, Any, Any]:
    """Send a request; if the connection turns out to be broken, send it once more at once over a new connection."""
    try:
        return (yield from request)
    except ServiceNotAnswering:
        return (yield from request)
