"""The state of the robot, its motion and its events, as messages. Units are m, rad, s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from maya_un.schema.jobs import JobLine, OperatorQuestion, PauseReason, QueueMode
from maya_un.values import Joints, Notice, Point, Progress, State

if TYPE_CHECKING:
    from maya_un.events import Event


@dataclass(frozen=True, slots=True)
class Status:
    """The current status: the machine, the running motion, the queue.

    `address` is the controller's, "sim" for the twin; `speed` is the speed of the twin's clock, 1 on a machine.
    `holding` is None if unknown. `last_event` is the number of the newest event. `run` counts the starts of the
    program; without a stored queue it is the date of the start as digits. Each start numbers its events from 1.
    `jobs` has the running job and the first waiting ones. `queue` is the mode of the queue, `reason` why it is paused.
    With an `unconfirmed` datum, which a person gave, motion is slow and bounded. `question` is that of a job to the
    operator, None without one.
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
    reason: PauseReason | Literal[""] = ""
    unconfirmed: bool = False
    question: OperatorQuestion | None = None


@dataclass(frozen=True, slots=True)
class EventMessage:
    """An event as interfaces send it: number, time [s] of the robot's clock, kind, code (0 for none), details."""

    seq: int
    time: float
    kind: str
    code: int
    detail: dict[str, str | int | float | bool | None]

    @classmethod
    def of(cls, event: Event) -> EventMessage:
        """Return the message for an event; details of other types become text."""
        detail = {key: plain(value) for key, value in event.detail.items()}
        return cls(event.seq, event.time, event.kind, event.code, detail)


@dataclass(frozen=True, slots=True)
class Jogged:
    """Distance of a jog along its `axis` (rad or m, signed), "" for a vector.

    `limit` is the name of the limit that shortens the requested distance, "" for none; `reason` describes it.
    """

    axis: str
    distance: float
    limit: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class PathPoint:
    """A point of a path: its `time` from the start of the motion [s], the `joints` and the gripper `point` there.

    `time` is None if a pause prevents it.
    """

    time: float | None
    joints: Joints
    point: Point


@dataclass(frozen=True, slots=True)
class NextStep:
    """The step number `step` of job `job` that follows the running one: its label, its primitive and its target.

    `target` is a point [m], joints (rad, m, m), whether the gripper opens, or None. `points` are at most 64 points of
    the gripper on its path [m]; empty while they are computed, if the step moves nothing, and if it would be refused.
    """

    job: int
    step: int
    label: str
    primitive: str
    target: tuple[float, float, float] | bool | None
    points: tuple[Point, ...] = ()


@dataclass(frozen=True, slots=True)
class MotionView:
    """The path of the motion under way, which began at loop time `began` [s]; times hold for the present speed.

    `path` is empty at rest, in a homing, and where another process carries motions out. `next` is the step after the
    running one, None without one.
    """

    began: float | None = None
    path: tuple[PathPoint, ...] = ()
    next: NextStep | None = None


@dataclass(frozen=True, slots=True)
class DatumView:
    """The datum that a person gave to the robot: its joints (rad, m, m), and whether a second point `confirmed` it.

    Both are None without one. If a person is `needed`, homing cannot find the position alone; `reason` says why.
    `homed_pose` is where a homing ends.
    """

    needed: bool
    reason: str
    given: Joints | None
    confirmed: bool | None
    homed_pose: Joints


@dataclass(frozen=True, slots=True)
class LinkView:
    """The link to the controller: whether it is `up`, and its quality. Times are real, in s.

    `reply` is the median time from the request for a record to its arrival, `late_reply` exceeds 95 % of these times.
    `records` is the number of records a second, `age` the time since the last one. `losses` counts how often the link
    was lost. Values that are unknown are None.
    """

    up: bool
    reply: float | None = None
    late_reply: float | None = None
    records: float | None = None
    age: float | None = None
    losses: int | None = None


@dataclass(frozen=True, slots=True)
class Signals:
    """Signals of the controller at loop time `time` [s], from its latest data record.

    `following_error` is the difference of the commanded and the measured position (rad, m, m), `torque` the motor
    command [V], `tension` that of the lines b and c in multiples of the load, None before homing. `inputs` and
    `outputs` are the digital ones from number 1 on; True is high.
    """

    time: float
    following_error: tuple[float, float, float]
    torque: tuple[float, float, float]
    tension: tuple[float, float] | None
    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]


@dataclass(frozen=True, slots=True)
class HeldJog:
    """The state of a held jog: `moving` or at rest. `limit` names the limit that ended it, or ""; `reason` explains it.

    A jog that neither moves nor met a limit waits while the previous one brakes, or was stopped. One that was stopped
    begins again only after its key was released and pressed.
    """

    axis: str
    direction: int
    moving: bool
    limit: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class SteeredJog:
    """The state of a held jog along a `vector`: the one that the robot follows; its length is the share of the speed.

    The other fields are those of `HeldJog`.
    """

    vector: tuple[float, float, float]
    moving: bool
    limit: str = ""
    reason: str = ""


def plain(value: object) -> str | int | float | bool | None:
    """Return a detail of an event as interfaces send it: values of other types become text."""
    return value if value is None or isinstance(value, str | int | float | bool) else str(value)


@dataclass(frozen=True, slots=True)
class Kept:
    """A recording in the folder: its file `name`, the date of its saving (UTC), why it was saved, its size."""

    name: str
    date: str
    reason: str
    bytes: int


@dataclass(frozen=True, slots=True)
class Readiness:
    """Whether the robot is ready for commands, and the reasons if not."""

    ready: bool
    reasons: tuple[Notice, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """Positions of the parts on the twin's table [m], by name, and its true `joints` (rad, m, m).

    The joints are those that a person would measure, also before homing; None if they are unknown.
    """

    parts: dict[str, Point]
    joints: Joints | None = None


@dataclass(frozen=True, slots=True)
class TableView:
    """The parts by name, each at its grasp point [m], and the part that the gripper carries, if any.

    With `source` "twin" the twin reports them. With "believed" they are the parts of the latest job that names any,
    at the places where jobs have put them: no sensor measures them. A place is None in the gripper, and if it is
    unknown. `holding` is whether the gripper holds a part, None if unknown.
    """

    source: Literal["twin", "believed"]
    parts: dict[str, Point | None]
    carried: str | None
    holding: bool | None


@dataclass(frozen=True, slots=True)
class Addresses:
    """The URLs at which other computers reach the service, the best one first; none if it is for this computer."""

    remote: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Health:
    """The server is running."""

    status: Literal["ok"]
    version: str


@dataclass(frozen=True, slots=True)
class TerminalReply:
    """The answer of the controller to a `command`: its lines, or its error `code` (TC1) with the `reason`.

    `code` is 0 for an accepted command. A longer `reply` is cut off at 20 000 characters.
    """

    command: str
    reply: str
    code: int = 0
    reason: str = ""
