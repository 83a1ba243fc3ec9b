"""Questions about now, and about what could be: nothing here moves anything. Units are m, rad, s."""

from __future__ import annotations

from maya_un.api.messages import Reach, Status
from maya_un.client.jobs import JobLike, body_of
from maya_un.client.plans.patience import AT_REST
from maya_un.client.steps import Plan, Request, get
from maya_un.config import Config
from maya_un.process.inspection import JobInspection
from maya_un.process.preview import JobPreview
from maya_un.values import Joints, Point, State


def status() -> Request[Status]:
    """Return everything about now: the machine, the motion under way, the queue."""
    return get("/v1/status", Status)


def state() -> Plan[State]:
    """Return the latest state of the machine."""
    return (yield from status()).state


def twin_parts() -> Plan[dict[str, Point]]:
    """Return where the parts stand on the twin's table by its own record [m]; raises `NotFound` on a real machine."""
    return (yield from get("/v1/twin", dict[str, dict[str, Point]]))["parts"]


def preview(job: JobLike) -> Request[JobPreview]:
    """Return what a job would be from where the robot is: times, heights, and the first refusal; nothing moves."""
    return Request("POST", "/v1/preview", JobPreview, body=body_of(job), timeout=AT_REST)


def inspect(job: JobLike, *, samples: int = 200) -> Request[JobInspection]:
    """Return a job in detail: profiles of the axes, least margins, the longest stop; nothing moves.

    Every motion has so many `samples`.
    """
    return Request("POST", "/v1/inspect", JobInspection, {"samples": samples}, body_of(job), AT_REST)


def reach(x: float, y: float, z: float) -> Request[Reach]:
    """Tell whether the point x, y, z [m] can be reached, and if not why, and where the nearest one is that can."""
    return get("/v1/reach", Reach, x=x, y=y, z=z)


def fk(a: float, b: float, c: float) -> Request[Point]:
    """Return the gripper point of joints (rad, m, m); raises `Unreachable`."""
    return get("/v1/fk", Point, a=a, b=b, c=c)


def ik(x: float, y: float, z: float) -> Request[Joints]:
    """Return the joints (rad, m, m) that hold the gripper at x, y, z [m]; raises `Unreachable`."""
    return get("/v1/ik", Joints, x=x, y=y, z=z)


def config() -> Request[Config]:
    """Return all constants of the machine, with the zones in force."""
    return get("/v1/config", Config)
