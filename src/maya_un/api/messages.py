"""What goes through the door, besides the values of the floors: frozen dataclasses, SI units, one definition.

`to_data` and `to_json` turn any of them, and `State`, `Event`, `JobReport`, `JobPreview`, `StopReport`, into what
an edge sends. Points are [x, y, z], joints [a, b, c].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import TypeAdapter

from maya_un.errors import Unreachable
from maya_un.events import Event
from maya_un.kinematics.limits import Limit, unit
from maya_un.kinematics.workspace import Workspace
from maya_un.process.view import JobLine, QueueMode
from maya_un.values import Joints, Point, Progress, State


@dataclass(frozen=True, slots=True)
class JobAccepted:
    """A job is in the queue under the number `id`, with so many `steps` over all rounds and cells."""

    id: int
    name: str
    steps: int


@dataclass(frozen=True, slots=True)
class Status:
    """Everything about now: the machine, the motion under way, the queue.

    `address` is the controller's, "sim" for the twin; `speed` is the speed of the twin's clock, 1 on a machine.
    `holding` is None where nobody knows; `last_event` is the number of the newest event, `run` that of this start of
    the program, which numbers its events anew; `jobs` has what runs and the first that wait. `queue` tells whether jobs
    begin, and `reason` why not.
    """

    version: str
    address: str
    speed: float
    state: State
    progress: Progress | None
    can_teleop: bool
    holding: bool | None
    jobs: tuple[JobLine, ...]
    last_event: int
    run: int = 1
    queue: QueueMode = QueueMode.RUNNING
    reason: str = ""


@dataclass(frozen=True, slots=True)
class HeldJog:
    """How a held jog stands: `moving` or at rest. `limit` names what ended it, "" where nothing did; `reason` says it.

    One that neither moves nor met a limit was stopped, and begins anew once the key was let go.
    """

    axis: str
    direction: int
    moving: bool
    limit: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Distance:
    """How far a place is from a `limit`, in its `unit` ("m", "rad" or "load"); `zone` is the name of one, else ""."""

    limit: str
    zone: str
    margin: float
    unit: str


@dataclass(frozen=True, slots=True)
class Broken:
    """A `limit` that a place breaks by `excess`, in its `unit` ("m", "rad" or "load"), in words; `zone` as above."""

    limit: str
    zone: str
    excess: float
    unit: str
    text: str


@dataclass(frozen=True, slots=True)
class Reach:
    """Whether a point can be reached; by which joints (rad, m, m), or why not and where instead [m].

    Of a point that can be reached it tells the `margins` to every limit and the `tensions` of lines b and c in
    multiples of the load, of another all limits that it has `broken`; `reason` is the first of them. `nearest` is None
    where the zones leave nothing.
    """

    reachable: bool
    joints: Joints | None
    reason: str | None
    nearest: Point | None
    margins: tuple[Distance, ...] = ()
    tensions: tuple[float, float] | None = None
    broken: tuple[Broken, ...] = ()

    @classmethod
    def of(cls, workspace: Workspace, point: Point) -> Reach:
        """Return the answer about `point` [m] in `workspace`."""
        reasons = workspace.all_reasons(point)
        if reasons:
            broken = tuple(Broken(one.limit, one.zone, one.excess, one.unit, one.text) for one in reasons)
            return cls(False, None, str(reasons[0]), _nearest(workspace, point), broken=broken)
        joints = workspace.require(point)
        found = workspace.margins(joints)
        distances = [Distance(limit, "", margin, unit(limit)) for limit, margin in found.limits.items()]
        distances += [Distance(Limit.ZONE, zone, clearance, "m") for zone, clearance in found.zones]
        pulls = (workspace.tension_limit - found.tension_b, workspace.tension_limit - found.tension_c)
        return cls(True, joints, None, point, tuple(distances), pulls)


def _nearest(workspace: Workspace, point: Point) -> Point | None:
    try:
        return workspace.nearest(point)
    except Unreachable:
        return None


@dataclass(frozen=True, slots=True)
class EventMessage:
    """An event as edges send it: number, loop time [s], kind, code (0 where none), details."""

    seq: int
    time: float
    kind: str
    code: int
    detail: dict[str, str | int | float | bool | None]

    @classmethod
    def of(cls, event: Event) -> EventMessage:
        """Return the message for an event; details that are not plain become text."""
        detail = {key: plain(value) for key, value in event.detail.items()}
        return cls(event.seq, event.time, event.kind, event.code, detail)


@dataclass(frozen=True, slots=True)
class AuditLine:
    """Who asked for what, from where, when (ISO 8601, UTC), and what came of it: `code` is 0, or the error's."""

    number: int
    date: str
    who: str
    role: str
    source: str
    operation: str
    code: int
    detail: str


def plain(value: object) -> str | int | float | bool | None:
    """Return a detail of an event as an edge sends it: what is not plain becomes text."""
    return value if value is None or isinstance(value, str | int | float | bool) else str(value)


@cache
def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def to_data(value: object) -> Any:
    """Return a message as plain data for JSON."""
    return _adapter(type(value)).dump_python(value, mode="json")


def to_json(value: object) -> bytes:
    """Return a message as JSON."""
    return _adapter(type(value)).dump_json(value)
