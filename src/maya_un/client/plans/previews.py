"""Reports of the robot, and previews of jobs; nothing moves. Units are m, rad, s."""

from __future__ import annotations

from typing import TYPE_CHECKING

from maya_un.client import requests
from maya_un.client.jobs import JobLike, body_of
from maya_un.client.request import Request
from maya_un.client.steps import Plan

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
