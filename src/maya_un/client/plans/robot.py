"""Plans that report on the robot, preview its jobs, move it or stop it. Units are m, rad, s.

A primitive is waited for: its report is returned when it is done, and why it was not is raised. Ctrl-C, or the end of
the awaiting task, cancels it, which stops the robot on its path.
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
    """Return where the parts stand on the twin's table by its own record [m]; raises `NotFound` on a real machine."""
    return (yield from requests.twin()).parts


def preview(job: JobLike) -> Request[JobPreview]:
    """Return what a job would be from where the robot is: times, heights, and the first refusal; nothing moves."""
    return requests.preview(body_of(job))


def inspect(job: JobLike, *, samples: int = 200) -> Request[JobInspection]:
    """Return a job in detail: profiles of the axes, least margins, the longest stop; nothing moves.

    Every motion has so many `samples`.
    """
    return requests.inspect(body_of(job), samples=samples)


INTERRUPTED = (KeyboardInterrupt, asyncio.CancelledError)
"""Errors that end a plan because nobody waits for it any more."""


def command(command: Mapping[str, object], *, timeout: float | None = None) -> Plan[JobReport]:
    """Carry out one primitive, like {"command": "pick", "target": [0.5, 1.1]}, and return its report.

    Raises why it was refused or ended early, and `TimeoutError` after `timeout` [s, real time], whereupon it goes on.
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
    """Cancel a command without an answer: the repeated request's key is answered with the job that it became."""
    number = (yield from request).id
    yield from requests.cancel(number)


def followed(number: int, since: int, timeout: float | None = None) -> Plan[JobReport]:
    """Wait for the end of a command that has no news before the event `since`; raises as `command` does."""
    try:
        report = yield from ended(number, since, timeout)
    except INTERRUPTED:
        yield from requests.cancel(number)
        raise
    if report.state is not TaskState.DONE:
        raise transport.as_error(report.code, report.message)
    return report


def jog(axis: str, distance: float, *, speed: float = 1.0, clip: bool = True) -> Plan[Jogged]:
    """Move along an axis (a, b, c; x, y, z, r of the gripper) by `distance` (rad or m); tell how far it went.

    It goes as far as the workspace allows; with `clip` false more than that is refused. Ctrl-C stops the robot.
    """
    try:
        return (yield from requests.jog_by(axis, distance, speed=speed, clip=clip))
    except INTERRUPTED:
        yield from stop()
        raise


def stop() -> Plan[StopReport]:
    """Begin to brake at once, and tell how long and how far it takes; the queue is paused where jobs wait in it.

    It goes over a connection of its own, behind nothing, and needs neither role nor lease.
    """
    return (yield from _urgently(requests.stop()))


def abort() -> Plan[None]:
    """Stop without deceleration; the motors may go off, then `recover`."""
    return (yield from _urgently(requests.abort()))


def _urgently(request: Request[Any]) -> Generator[Step, Any, Any]:
    """Ask, and once more at once over a new connection where the old one turns out to be broken."""
    try:
        return (yield from request)
    except ServiceNotAnswering:
        return (yield from request)
