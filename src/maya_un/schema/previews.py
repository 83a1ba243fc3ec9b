"""Jobs and places as computed before any motion, as messages. Units are m, rad, s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from maya_un.values import Joints, Limit, MarginUnit, Notice, Point


class PhasePreview(NamedTuple):
    """Name and duration [s] of one phase; the duration of a homing is unknown in advance."""

    name: str
    duration: float | None


@dataclass(frozen=True, slots=True)
class StepPreview:
    """One step: durations in s (None for a homing), heights in m, `end_counts` in encoder counts.

    A step that is not `expected` belongs to a branch to which the present inputs, or the first answers, do not lead.
    """

    index: int
    key: str
    step: str
    duration: float | None
    phases: tuple[PhasePreview, ...]
    lowest: float | None
    highest: float | None
    end_counts: tuple[int, int, int] | None
    expected: bool = True


@dataclass(frozen=True, slots=True)
class Refusal:
    """The first step that would be refused, and the reason."""

    index: int
    key: str
    step: str
    notice: Notice


@dataclass(frozen=True, slots=True)
class JobPreview:
    """The preview of a job.

    `duration` [s] is the sum over the expected steps that can be predicted (not homing). `lowest` and `highest` are the
    extreme heights of the gripper point [m]. If there is a `refusal`, `steps` ends before the refused step. Maya would
    then refuse the whole job.
    """

    duration: float
    lowest: float | None
    highest: float | None
    steps: tuple[StepPreview, ...]
    refusal: Refusal | None


@dataclass(frozen=True, slots=True)
class Band:
    """A phase of a step, from `start` to `end` [s] of the job."""

    step: int
    phase: str
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Nearest:
    """The smallest margin of a job to a limit or, with `zone`, to a zone of that `name`; its step and time [s]."""

    name: str
    margin: float
    unit: MarginUnit
    zone: bool
    step: int
    time: float


@dataclass(frozen=True, slots=True)
class Samples:
    """The samples of a motion: times from the job's start [s], joints [rad, m, m] and velocities [rad/s, m/s, m/s]."""

    step: int
    time: tuple[float, ...]
    joints: tuple[tuple[float, float, float], ...]
    velocity: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class JobInspection:
    """A job in detail. A homing counts as no time, because its duration is unknown in advance.

    `stop_time` [s] and `stop_distance` [m] are those of the longest stop; both are 0 without motion.
    """

    preview: JobPreview
    bands: tuple[Band, ...]
    closest: tuple[Nearest, ...]
    stop_time: float
    stop_distance: float
    motions: tuple[Samples, ...]


@dataclass(frozen=True, slots=True)
class Distance:
    """The margin of a place to a `limit`, in its `unit`; `zone` is its name if it is a zone."""

    limit: Limit
    zone: str
    margin: float
    unit: MarginUnit


@dataclass(frozen=True, slots=True)
class NearestLimits:
    """The limits nearest to the robot: in each unit the one with the least margin.

    `nearest` is empty before homing.
    """

    nearest: tuple[Distance, ...] = ()


@dataclass(frozen=True, slots=True)
class Broken:
    """A `limit` that a place exceeds by `excess`, in its `unit`; `zone` as in `Distance`."""

    limit: Limit
    zone: str
    excess: float
    unit: MarginUnit
    text: str


@dataclass(frozen=True, slots=True)
class Reach:
    """Whether a point is reachable: by which joints (rad, m, m), or why not, and the nearest reachable point [m].

    A reachable point has the `margins` to every limit and the `tensions` of lines b and c in multiples of the load;
    another point has all limits that it has `broken`, the first of which is the `reason`. `nearest` is None if the
    zones leave no reachable point.
    """

    reachable: bool
    joints: Joints | None
    reason: str | None
    nearest: Point | None
    margins: tuple[Distance, ...] = ()
    tensions: tuple[float, float] | None = None
    broken: tuple[Broken, ...] = ()


@dataclass(frozen=True, slots=True)
class Reachability:
    """Whether each of several points is reachable, in their order."""

    reachable: tuple[bool, ...]


class Range(NamedTuple):
    """A range, from `least` to `greatest`."""

    least: float
    greatest: float


class SectionPoint(NamedTuple):
    """A point of the vertical section: distance `d` from axis a, height `z` [m]."""

    d: float
    z: float


@dataclass(frozen=True, slots=True)
class WorkspaceShape:
    """The shape of the workspace, without zones.

    It is the section inside the closed `outline`, turned about axis a through the range of the `boom` [rad]. At the
    height `z` [m], if it was asked for, the gripper reaches the `rings`: ranges of the distance from axis a [m].
    """

    boom: Range
    outline: tuple[SectionPoint, ...]
    z: float | None = None
    rings: tuple[Range, ...] = ()


@dataclass(frozen=True, slots=True)
class JobMistake:
    """A mistake in the text of a job: its `line` and `column`, counted from 1, and its `key` ("" if it is no YAML)."""

    line: int
    column: int
    key: str
    reason: str


@dataclass(frozen=True, slots=True)
class ParsedJob:
    """The job in a text, as plain data; None if the text has a `mistake`."""

    job: dict[str, Any] | None
    mistake: JobMistake | None = None


@dataclass(frozen=True, slots=True)
class ExampleJob:
    """An example of a job: its `name`, and its `text` in YAML.

    `title` and `about` are texts by language ("en", "es").
    """

    name: str
    title: dict[str, str]
    about: dict[str, str]
    text: str


@dataclass(frozen=True, slots=True)
class JobText:
    """The text of a job in YAML."""

    text: str
